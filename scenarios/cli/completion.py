"""Names that the shell completes, found without heavy imports."""

from __future__ import annotations

from pathlib import Path

_LIBRARY = Path(__file__).parents[1] / "library"


def scenarios(incomplete: str) -> list[str]:
    """Return the matching scenarios; if there are none, the shell completes files."""
    from scenarios.files import scenarios_in

    return [name for name in scenarios_in(_LIBRARY) if name.startswith(incomplete)]


def compared(incomplete: str) -> list[str]:
    """Return the matching scenarios and groups."""
    return [*scenarios(incomplete), *_names(_LIBRARY / "groups", incomplete)]


def sweeps(incomplete: str) -> list[str]:
    """Return the matching sweeps."""
    return _names(_LIBRARY / "sweeps", incomplete)


def resolvers(incomplete: str) -> list[str]:
    """Return the completions of the last entry of a list "tpm,hcod,..."."""
    import solvers

    before, comma, last = incomplete.rpartition(",")
    return [f"{before}{comma}{name}" for name in (*solvers.names(), *solvers.variants())
            if name.startswith(last)]


def _names(folder: Path, incomplete: str) -> list[str]:
    return sorted(path.stem for path in folder.glob("*.toml") if path.stem.startswith(incomplete))
