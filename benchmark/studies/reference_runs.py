"""The authors' runs again, from tests/data/ellipse: python -m benchmark.studies.reference_runs.

How closely simulation repeats them with the derivatives that they were made with, and how far the
commands with exact derivatives are from the recorded ones, at the recorded states. The recordings
are what the tests judge by; a benchmark is no product, so it may read them where they are.
"""

from pathlib import Path

import numpy as np

from hierarchy.problem import Array
from scenarios import load
from scenarios.cell.build import build
from scenarios.loop.controller import Controller
from scenarios.loop.simulation import uninterrupted

DATA = Path(__file__).parents[2] / "tests" / "data" / "ellipse"
EVERY = 10  # one in so many ticks is recorded
_AS_PUBLISHED = ["control.jacobian_derivative=difference"]
RUNS = {
    "inequality_5deg": ("ellipse", _AS_PUBLISHED),
    "inequality_35deg": ("ellipse-35deg", _AS_PUBLISHED),
    "equality_35deg": ("ellipse-35deg-equality", _AS_PUBLISHED),
    "avoidance_3d_first5s": ("ellipse-3d", [*_AS_PUBLISHED, "control.duration=5.0"]),
    "published_jacobians_inequality_5deg": ("ellipse-published", []),
}
RIGHT = ("inequality_5deg", "inequality_35deg", "equality_35deg")  # calm, with right Jacobians


def reference(name: str) -> dict[str, Array]:
    """Return the arrays of an authors' run, a row for every tenth tick."""
    with np.load(DATA / f"{name}.npz") as file:
        return dict(file)


def differences(name: str) -> Array:
    """Return how far commands with exact derivatives are from the recorded ones [rad/s^2].

    The state is that of the tick before a row, whose command was recorded: one integration undone.
    """
    expected, scenario = reference(name), load(RUNS[name][0])
    T, controller, found = scenario.control.period, Controller(build(scenario)), []
    for k in range(1, len(expected["t"])):
        a = expected["a_previous"][k]
        v = expected["v"][k] - a * T
        q = expected["q"][k] - v * T - a * T * T / 2
        found.append(np.abs(controller.command(expected["t"][k] - T, q, v) - a).max())
    return np.array(found)


def main() -> None:
    """Print everything."""
    print(f"{'simulated again':37} ticks   q off by   same active point")
    for name, (scenario, changes) in RUNS.items():
        run, expected = uninterrupted(load(scenario, changes)), reference(name)
        off = np.abs(run["q"][::EVERY] - expected["q"]).max()
        same = (run["active_control_point"][::EVERY] == expected["active_control_point"]).mean()
        print(f"  {name:35} {run.ticks:5} {off:6.0e} rad {100 * same:10.2f} %")
    print(f"\n{'exact derivatives, recorded states':37} ticks  commands off by [rad/s^2]")
    for name in RIGHT:
        found = differences(name)
        low, median, high = np.percentile(found, [25, 50, 75])
        print(f"  {name:35} {len(found):5}  {median:.1e} [{low:.1e}, {high:.1e}], "
              f"at most {found.max():.2g}")


if __name__ == "__main__":
    main()
