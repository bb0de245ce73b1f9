"""Comparison with other packages from PyPI: same arm, same path, same limits.

`hierarchy bench peers`, after `hierarchy bench peers --install`. Imports are minimal, since these
files also run in the environments of the other packages.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from scenarios.bench.peers.entrants import Entrant


def run(out: Path | None = None, entrants: Sequence[Entrant] | None = None,
        ticks: int = 20_000, seconds: float = 20.0) -> list[dict[str, Any]]:
    """See `scenarios.bench.peers.compare.run`."""
    from scenarios.bench.peers.compare import run as run_all

    return run_all(out, entrants, ticks, seconds)
