"""Null-space damping by the inertia matrix, eq. (15): python docs/studies/inertia.py.

How fast D = M(q) damps the freedom that the tasks of `ellipse` leave, and what becomes of the run
if only the joints that it hardly damps are damped as by D = 5 I.
"""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np

from hierarchy import Stack, State
from hierarchy.problem import Array
from hierarchy.tasks import JointDamping
from scenarios import load
from scenarios.cell.build import build
from scenarios.loop.controller import Controller

LIGHT = (4, 5, 6)  # the joints of the wrist
FASTEST = 100.0      # [rad/s] a run that is faster has diverged


@dataclasses.dataclass(frozen=True)
class PartlyInertia(JointDamping):
    """D = k M(q) in the rows of some joints, and 5 I in those of the others."""

    plain: tuple[int, ...] = LIGHT

    def reference_acceleration(self, state: State) -> Array:
        """-D v (n,) [rad/s^2]."""
        a = super().reference_acceleration(state)
        a[list(self.plain)] = -5.0 * state.v[list(self.plain)]
        return a


def run(scenario: Any, damping: JointDamping | None = None) -> dict[str, Any]:
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


def main() -> None:
    """Print everything."""
    plain = run(load("ellipse"))
    low, high = plain["rates"].T
    print("ellipse: inertia seen by each joint, median [kg m^2]:",
          np.array2string(np.median(plain["inertia"], axis=0), precision=4))
    print(f"rate per k in the null space, median: slowest {np.median(low):.2g}, fastest "
          f"{np.median(high):.2g} 1/s; from {low.min():.2g} to {high.max():.2g}")
    for k in (1.0, 5.0):
        scenario = load("ellipse-inertia", {"damping.value": k})
        cases = {"k M": None, "k M, wrist 5 I": PartlyInertia(7, k, "mass"),
                 "5 I, wrist k M": PartlyInertia(7, k, "mass", plain=(0, 1, 2, 3))}
        for name, damping in cases.items():
            done = run(scenario, damping)
            print(f"k = {k:g}, {name}: {done['speed']:.3g} rad/s, {done['seconds']:.1f} s")


if __name__ == "__main__":
    main()
