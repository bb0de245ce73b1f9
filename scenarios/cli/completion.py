"""What the shell may complete: names, found without importing anything heavy."""

from __future__ import annotations

from pathlib import Path

_LIBRARY = Path(__file__).parents[1] / "library"


def scenarios(incomplete: str) -> list[str]:
    """Return the scenarios that begin so, or nothing: then the shell completes files."""
    return _names(_LIBRARY, incomplete)


def sweeps(incomplete: str) -> list[str]:
    """Return the sweeps that begin so."""
    return _names(_LIBRARY / "sweeps", incomplete)


def resolvers(incomplete: str) -> list[str]:
    """Return the resolvers that the last of a list "tpm,hcod,..." may be."""
    import solvers

    before, comma, last = incomplete.rpartition(",")
    return [f"{before}{comma}{name}" for name in solvers.names() if name.startswith(last)]


def _names(folder: Path, incomplete: str) -> list[str]:
    return sorted(path.stem for path in folder.glob("*.toml") if path.stem.startswith(incomplete))
