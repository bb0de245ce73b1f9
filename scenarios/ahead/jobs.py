"""What runs while kernels are recorded: each kind of call of the documents, once."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path


def _command(text: str, folder: Path) -> None:
    """Run a command of the program that writes to a folder."""
    from scenarios.cli.main import run_command

    if run_command([*text.split(), "--out", str(folder / "out")]) not in (0, 1):
        raise SystemExit(f"hierarchy {text} failed")


def _arrays(folder: Path) -> None:
    """Solve hierarchies of plain arrays with every resolver."""
    import numpy as np

    from hierarchy import Hierarchy
    from solvers import certify, explain, make, names

    one = Hierarchy.from_levels([(np.eye(3)[:1], [1.0]), (np.eye(3)[1:], [1.0, 2.0])])
    for name in names():
        make(name).solve(one)
    h = Hierarchy.from_levels([([[1, 0], [0, 1]], [-0.1] * 2, [0.1] * 2), ([[1.0, 0.5]], [0.3])])
    result = make("hcod").solve(h)
    explain(h, result)
    certify(h, result.x)


JOBS: dict[str, Callable[[Path], None]] = {
    "arrays": _arrays,
    **{text: partial(_command, text) for text in (
        "run ellipse --duration 0.01",
    )},
}
