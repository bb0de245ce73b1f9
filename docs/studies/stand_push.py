"""How hard a humanoid on two feet can be pushed: python docs/studies/stand_push.py --count 40.

The generic humanoid stands in MuJoCo with torque motors and friction, 1000 commands a second. A
force at the trunk, of sampled direction and size, pushes it for 0.1 s; each contender gets the same
pushes. It has fallen once its centre of mass is 0.2 m below the start, or the run diverges.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from dataclasses import dataclass
from time import perf_counter

import numpy as np

from hierarchy import Hierarchy, Robot, Stack, State
from hierarchy.contacts import Contact, Contacts
from hierarchy.paths import Still
from hierarchy.problem import Array
from hierarchy.tasks import (
    BaseDynamics,
    CentreOfMass,
    ContactMotion,
    Friction,
    JointLimits,
    LeastForce,
    Momentum,
    Position,
    Posture,
    Together,
    TorqueLimits,
)
from scenarios.cell.plants.ground import Floor
from scenarios.cell.plants.torque import TorqueRobot
from scenarios.measure.statistics import wilson
from solvers import Status, make
from solvers.resolver import Resolver

PERIOD, DURATION = 0.001, 2.5   # [s]
PUSHED, STARTS, LASTS = "trunk_pitch", 0.3, 0.1  # a joint; [s]
SIZES = 40.0, 280.0             # [N]
FALLEN = 0.2                    # [m] of the centre of mass below its start
BINS = ((40.0, 120.0), (120.0, 200.0), (200.0, 280.0))
DIVERGED = 200.0                # [rad/s] of a joint
# Squares of these weigh the sums of squares, as usual in controllers of weighted tasks.
WEIGHTS = {"centre of mass": 1.0, "left_hand": 1.0, "right_hand": 1.0, "posture": 0.3,
           "least force": 0.003}

Levels = Callable[[Hierarchy], Hierarchy]


@dataclass(frozen=True)
class Contender:
    """A resolver, what its stack has, and what becomes of the hierarchy before it gets it.

    `momentum`: the angular momentum is braked by a level above the centre of mass.
    """

    name: str
    resolver: Resolver
    levels: Levels
    inequalities: bool = True
    momentum: bool = False


def strict(h: Hierarchy) -> Hierarchy:
    """Return the hierarchy as it is."""
    return h


def weighted(h: Hierarchy) -> Hierarchy:
    """Return physics and limits as they are, and all tasks below as one weighted level."""
    A, lower, upper = h.A.copy(), h.lower.copy(), h.upper.copy()
    for name, i, j in zip(h.names, h.offsets[:-1], h.offsets[1:], strict=True):
        A[i:j] *= WEIGHTS.get(name, 1.0)
        lower[i:j] *= WEIGHTS.get(name, 1.0)
        upper[i:j] *= WEIGHTS.get(name, 1.0)
    above = [name not in WEIGHTS for name in h.names]
    sizes = np.array([*h.sizes[above], h.m - h.sizes[above].sum()])
    names = (*(name for name in h.names if name not in WEIGHTS), "tasks")
    return Hierarchy(A, lower, upper, sizes, h.reference, names)


CONTENDERS = (Contender("strict levels, hcod", make("hcod"), strict),
              Contender("strict levels, angular momentum first, hcod", make("hcod"), strict,
                        momentum=True),
              Contender("weighted tasks, hcod", make("hcod"), weighted),
              Contender("strict equalities, tpm", make("tpm"), strict, False))


@dataclass(frozen=True)
class Outcome:
    """One run: whether it fell, slip [m], share of ticks with an unsolved stack, time a tick [s].

    `clipped` is the share of ticks with a torque at its limit, `missed` the mean miss of the centre
    of mass [m/s^2], `force_error` the 95th percentile over the ticks without push of the largest
    component of a sole's force that MuJoCo has and the stack did not predict [N].
    """

    fell: bool
    slip: float
    unsolved: float
    tick: float
    clipped: float
    missed: float
    force_error: float


def stack_for(contender: Contender, contacts: Contacts, state: State) -> Stack:
    """Return the stack: stand, keep the hands where they are, keep the posture."""
    robot = contacts.robot
    com = CentreOfMass(robot, Still((0.0, 0.0, 0.0))).position(state)
    hands = [robot.frame(name) for name in ("left_hand", "right_hand")]
    limits = [Together([TorqueLimits(robot, contacts=contacts), Friction(contacts)], "limits"),
              JointLimits(robot, 300.0, PERIOD)]
    return Stack([
        Together([BaseDynamics(contacts), ContactMotion(contacts)], "physics"),
        *(limits if contender.inequalities else []),
        *([Momentum("angular", damping=5.0)] if contender.momentum else []),
        CentreOfMass(robot, Still(com), stiffness=40.0, damping=13.0),
        *(Position(hand, Still(state.position(hand)), 100.0, 20.0, name=hand.name)
          for hand in hands),
        Posture(tuple(robot.rest[7:]), 30.0, 11.0), LeastForce(contacts),
    ], "torque", contacts=contacts)


def set_up(contender: Contender, friction: float, floor: Floor,
           delay: int) -> tuple[Contacts, State, TorqueRobot, Stack]:
    """Put the humanoid on the floor; `friction` is what the controller believes."""
    robot = Robot.named("humanoid")
    contacts = Contacts(robot, [Contact.rectangle(robot.frame(f"{side}_foot"), (-0.05, 0.16),
                                                  (-0.04, 0.04), friction)
                                for side in ("left", "right")])
    state = State.at(robot, robot.rest)
    plant = TorqueRobot(robot, contacts, robot.rest, period=PERIOD, floor=floor, delay=delay)
    return contacts, state, plant, stack_for(contender, contacts, state)


def run(contender: Contender, force: Array, friction: float, floor: Floor,
        delay: int = 0) -> Outcome:
    """Push once, and stand if possible; `friction` is what the controller believes."""
    contacts, state, plant, stack = set_up(contender, friction, floor, delay)
    com: CentreOfMass = stack["centre of mass"]  # type: ignore[assignment]
    height, limit = com.position(state)[2], contacts.robot.effort_limit[6:]
    feet = [contact.frame for contact in contacts.contacts]
    start = [state.position(foot) for foot in feet]
    memory, torques, slip, ticks, errors = None, np.zeros(30), 0.0, [], [0.0]
    counts, fell, k = np.zeros(3), False, 0  # unsolved, clipped, sum of misses
    for k in range(round(DURATION / PERIOD)):
        fell = (not state.move(k * PERIOD, plant.q, plant.v) or np.abs(plant.v).max() > DIVERGED
                or com.position(state)[2] < height - FALLEN)
        if fell:
            break
        begin = perf_counter()
        h = stack.hierarchy(state)
        res = contender.resolver.solve(contender.levels(h), memory)
        ticks.append(perf_counter() - begin)
        memory = res.memory
        if res.status in (Status.SOLVED, Status.INACCURATE):  # else the torques of before
            torques = np.clip(contacts.torques(state, res.x), -limit, limit)
        counts += (res.status is not Status.SOLVED, (np.abs(torques) > 0.999 * limit).any(),
                   h.violations(res.x)[h.names.index("centre of mass")])
        pushing = STARTS <= state.t < STARTS + LASTS
        plant.act(torques, (PUSHED, force) if pushing else None)
        if not pushing:
            errors.append(max(np.abs(force_on_sole - contacts.forces(res.x, sole).sum(axis=0)).max()
                              for sole, force_on_sole in plant.forces().items()))
        slip = max(slip, *(float(np.linalg.norm((state.position(foot) - at)[:2]))
                           for foot, at in zip(feet, start, strict=True)))
    unsolved, clipped, missed = (counts / (k + 1)).tolist()
    return Outcome(bool(fell), slip, unsolved, float(np.median(ticks)), clipped, missed,
                   float(np.quantile(errors, 0.95)))


def pushes(count: int, seed: int) -> Array:
    """Return horizontal forces (count, 3) [N] of any direction and of sizes within SIZES."""
    rng = np.random.default_rng(seed)
    size, angle = rng.uniform(*SIZES, count), rng.uniform(0.0, 2.0 * np.pi, count)
    return np.column_stack([size * np.cos(angle), size * np.sin(angle), np.zeros(count)])


def in_words(met: int, of: int) -> str:
    """Return "12 of 20 (39 to 78 %)" with the 95 % Wilson interval."""
    low, high = wilson(met, of)
    return f"{met} of {of} ({100 * low:.0f} to {100 * high:.0f} %)"


def report(name: str, forces: Array, outcomes: list[Outcome]) -> None:
    """Print how many pushes a contender survived, by size, and how it stood."""
    size, stood = np.linalg.norm(forces, axis=1), np.array([not one.fell for one in outcomes])
    print(f"{name}: stands after {in_words(int(stood.sum()), len(stood))}")
    for low, high in BINS:
        chosen = (size >= low) & (size < high)
        if chosen.any():
            print(f"  {low:.0f} to {high:.0f} N: "
                  f"{in_words(int(stood[chosen].sum()), int(chosen.sum()))}")
    survivors = [one for one in outcomes if not one.fell] or outcomes
    print(f"  of those standing, medians: slip {1e3 * median(survivors, 'slip'):.1f} mm, "
          f"a torque at its limit in {100 * median(survivors, 'clipped'):.1f} % of ticks, "
          f"centre of mass missed by {median(survivors, 'missed'):.2f} m/s^2, "
          f"force of a sole predicted to {median(survivors, 'force_error'):.2f} N")
    print(f"  of all: rows and resolution {1e6 * median(outcomes, 'tick'):.0f} us, "
          f"{100 * np.mean([one.unsolved for one in outcomes]):.2f} % of ticks not solved")


def median(outcomes: list[Outcome], what: str) -> float:
    """Return the median of one number of some outcomes."""
    return float(np.median([getattr(one, what) for one in outcomes]))


def main() -> None:
    """Run all contenders over the same pushes and print what became of them."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=40, help="pushes")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--friction", type=float, default=0.7, help="of the floor")
    parser.add_argument("--believed", type=float, help="by the controller; that of the floor")
    parser.add_argument("--joint-friction", type=float, default=0.0, help="[N m]")
    parser.add_argument("--delay", type=int, default=0, help="of the torques [ms]")
    asked = parser.parse_args()
    forces = pushes(asked.count, asked.seed)
    floor = Floor(asked.friction, joint_friction=asked.joint_friction)
    for contender in CONTENDERS:
        report(contender.name, forces, [
            run(contender, force, asked.believed or asked.friction, floor, asked.delay)
            for force in forces])


if __name__ == "__main__":
    main()
