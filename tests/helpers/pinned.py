"""Numbers of shipped robots and generated problems, which recorded results and seeds refer to.

    PYTHONPATH=. python tests/helpers/pinned.py      writes tests/data/pinned/ anew

Only after a change that is meant: seeds in reports and recorded runs then mean something else.
"""

import json
from pathlib import Path

import numpy as np
import pinocchio as pin

from hierarchy import Robot
from hierarchy.robots import TABLES
from solvers.problems import ANY, FAMILIES, KINDS, bounded, family, generate, structured

FOLDER = Path(__file__).parents[1] / "data" / "pinned"


def robot_facts(robot):
    """Limits, rest, masses, and where all that is fixed to a body is in one posture, as lists."""
    model, data = robot.model, robot.model.createData()
    q = pin.integrate(model, robot.rest, np.sin(1.0 + np.arange(robot.n)))
    pin.forwardKinematics(model, data, q)
    pin.updateFramePlacements(model, data)
    facts = {
        "lower": robot.lower, "upper": robot.upper, "velocity_limit": robot.velocity_limit,
        "effort_limit": robot.effort_limit, "rest": robot.rest, "masses": robot.masses,
        "inertia": np.diag(pin.crba(model, data, q)), "gravity": pin.nonLinearEffects(
            model, data, q, np.cos(np.arange(robot.n))),
        "frames": {frame.name: [place.translation, *place.rotation]
                   for frame, place in zip(model.frames, data.oMf, strict=True)},
        "control_points": {point.name: data.oMi[point.joint].act(np.asarray(point.offset))
                           for point in robot.control_points},
        "capsules": {one.name: [*(data.oMi[one.joint].act(np.array(end, dtype=float))
                                  for end in (one.start, one.end)), one.radius]
                     for one in robot.capsules},
        "end_effector": data.oMf[model.getFrameId(robot.end_effector)].translation,
    }
    return json.loads(json.dumps(facts, default=np.ndarray.tolist))


def problem_sums():
    """One number for each of many generated problems, by what made them."""
    sums = {f"kind {kind}": [sum_of(structured(seed, (kind,))) for seed in range(60)]
            for kind in KINDS}
    sums |= {f"family {name}": [sum_of(family(name, seed)) for seed in range(30)]
             for name in FAMILIES}
    sums["any kind"] = [sum_of(structured(seed)) for seed in range(40)]
    equalities = [structured(seed, equalities_only=True) for seed in range(40)]
    sums["equalities of any kind"] = [sum_of(h) for h in equalities]
    sums["bounded"] = [sum_of(bounded(h, seed)) for seed, h in enumerate(equalities)]
    sums["generated"] = [sum_of(generate(seed, ANY)) for seed in range(100)]
    return sums


def sum_of(h):
    """A weighted sum over all numbers of a hierarchy, in which small ones count too."""
    parts = [h.A.ravel(), h.lower, h.upper, h.reference, h.sizes.astype(float)]
    numbers = np.concatenate([np.where(np.isfinite(part), part, np.sign(part) * 7e7)
                              for part in parts])
    return float(np.arcsinh(1e3 * numbers) @ (1.0 + np.modf(0.618 * np.arange(len(numbers)))[0]))


def read(name):
    return json.loads((FOLDER / f"{name}.json").read_text(encoding="utf-8"))


def leaves(value, path=""):
    """Every number of nested lists and dictionaries, by its place."""
    if not isinstance(value, (dict, list)):
        return {path: value}
    items = value.items() if isinstance(value, dict) else enumerate(value)
    return {place: leaf for key, one in items
            for place, leaf in leaves(one, f"{path} {key}").items()}


def main():
    """Write both files, one line for each robot and kind of problem."""
    robots = {name: robot_facts(Robot.named(name)) for name in TABLES}
    for name, content in (("robots", robots), ("problems", problem_sums())):
        lines = ",\n".join(f"{json.dumps(key)}: {json.dumps(one)}" for key, one in content.items())
        (FOLDER / f"{name}.json").write_text(f"{{\n{lines}\n}}\n", encoding="utf-8")


if __name__ == "__main__":
    main()
