"""Null-space damping by the inertia matrix, eq. (15): python -m benchmark.studies.inertia.

How fast D = M(q) damps the freedom that the tasks of `ellipse` leave, and what becomes of the runs
if only the wrist, or all but the wrist, is damped as by D = 5 I; from sampled starts.
"""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np

from benchmark.machine import on_all_cores
from hierarchy import Stack, State
from hierarchy.problem import Array
from hierarchy.tasks import JointDamping
from scenarios import Scenario, load
from scenarios.cell.build import build
from scenarios.config.sampling import changed, drawn
from scenarios.loop.controller import Controller

LIGHT = (4, 5, 6)  # the joints of the wrist
FASTEST = 100.0    # [rad/s] a run that is faster has diverged
STARTS, SEED = 16, 14


@dataclasses.dataclass(frozen=True)
class PartlyInertia(JointDamping):
    """D = k M(q) in the rows of some joints, and 5 I in those of the others."""

    plain: tuple[int, ...] = LIGHT

    def reference_acceleration(self, state: State) -> Array:
        """-D v (n,) [rad/s^2]."""
        a = super().reference_acceleration(state)
        a[list(self.plain)] = -5.0 * state.v[list(self.plain)]
        return a


def run(scenario: Scenario, damping: JointDamping | None) -> dict[str, Any]:
    """Run a scenario; return its largest speed and rates at which D = M damps [1/s]."""
    cell = build(scenario)
    if damping is not None:
        tasks = [cell.stack[name] for name in cell.stack.names]
        cell = dataclasses.replace(cell, stack=Stack(tasks, scenario.control.level, damping))
    controller, T = Controller(scenario, cell), scenario.control.period
    fastest, rates, inertia = 0.0, [], []
    for k in range(round(scenario.control.duration / T)):
        controller.cell.plant.act(controller.command(k * T, cell.plant.q, cell.plant.v))
        fastest = max(fastest, float(np.abs(cell.plant.v).max()))
        if k % 50 == 0:
            rates.append(_rates(controller.hierarchy.A, cell.state.mass_matrix()))
            inertia.append(np.diag(cell.state.mass_matrix()))
        if not fastest < FASTEST:
            break
    return {"speed": fastest, "seconds": k * T, "rates": np.array(rates),
            "inertia": np.array(inertia)}


def _rates(A: Array, M: Array) -> tuple[float, float]:
    """Return the least and greatest eigenvalue of M in the null space of A (m, 7)."""
    _, s, Vt = np.linalg.svd(A)
    N = Vt[int((s > 1e-6 * s[0]).sum()):]
    found = np.linalg.eigvalsh(N @ M @ N.T)
    return found[0], found[-1]


def cases() -> dict[str, tuple[Scenario, JointDamping | None]]:
    """Return scenarios with k M, each with the damping in its place, by name."""
    found: dict[str, tuple[Scenario, JointDamping | None]] = {}
    for k in (1.0, 5.0):
        scenario = load("ellipse-inertia", {"damping.value": k})
        found |= {f"k = {k:g}, k M": (scenario, None),
                  f"k = {k:g}, k M, wrist 5 I": (scenario, PartlyInertia(7, k, "mass")),
                  f"k = {k:g}, 5 I, wrist k M": (
                      scenario, PartlyInertia(7, k, "mass", plain=(0, 1, 2, 3)))}
    return found


def main() -> None:
    """Print everything."""
    asked = {"": (load("ellipse"), None), **cases()}
    runs = on_all_cores(run, [
        (changed(scenario, drawn(scenario, scenario.variation, SEED, start), "variation"), damping)
        for scenario, damping in asked.values() for start in range(STARTS)])
    done = dict(zip(asked, (runs[i:i + STARTS] for i in range(0, len(runs), STARTS)), strict=True))
    plain = done.pop("")
    inertia = np.concatenate([one["inertia"] for one in plain])
    low, high = np.concatenate([one["rates"] for one in plain]).T
    joints = ", ".join(f"{value:.2g}" for value in np.median(inertia, axis=0))
    print(f"inertia seen by each joint of ellipse, median [kg m^2]: {joints}")
    print(f"k = 1: the freedom that is left is damped at {np.median(low):.2g} 1/s (slowest "
          f"direction, median) to {np.median(high):.2g} 1/s (fastest), at most {high.max():.2g}")
    print(f"largest joint speed [rad/s], median of {STARTS} starts, and how many end:")
    for name, some in done.items():
        speed = np.median([one["speed"] for one in some])
        ended = sum(one["speed"] < FASTEST for one in some)
        print(f"  {name:22} {speed:8.3g} {ended:4} of {STARTS}")


if __name__ == "__main__":
    main()
