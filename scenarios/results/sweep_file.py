"""The validated form of a sweep file: scenarios, resolvers and sampled parameters."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from pydantic import Field

from hierarchy.errors import UnknownNameError
from scenarios.config import is_shipped
from scenarios.config.distributions import Parameters
from scenarios.config.errors import ScenarioError
from scenarios.config.sections import Name, Section
from scenarios.config.validation import validated
from scenarios.toml_text import read_toml

LIBRARY = Path(__file__).parents[1] / "library" / "sweeps"


class Sweep(Section):
    """Every scenario under every resolver, with each of `samples` draws of the parameters.

    `parameters` are dotted keys of a scenario, with numbers as list indices. A drawn value depends
    only on `seed`, the sample's number and the key: adding samples, scenarios, resolvers or
    parameters does not change existing samples. `duration` [s] overrides that of the scenarios.
    With `variation` the scenarios' own `[variation]` is drawn too. Without resolvers each scenario
    has those that `hierarchy compare` takes by default.
    """

    name: Name
    title: str = ""
    scenarios: Annotated[tuple[str, ...], Field(min_length=1)]
    resolvers: tuple[str, ...] = ()
    duration: Annotated[float, Field(gt=0.0, allow_inf_nan=False)] | None = None
    samples: Annotated[int, Field(ge=1)]
    seed: Annotated[int, Field(ge=0)] = 0
    variation: bool = False
    parameters: Parameters = Field(default_factory=dict)


def shipped_sweeps() -> tuple[str, ...]:
    """Return the names of the sweeps shipped with the package."""
    return tuple(sorted(path.stem for path in LIBRARY.glob("*.toml")))


def find(name_or_path: str | Path) -> Path:
    """Return the file of a shipped sweep by name, or the given path.

    Raises UnknownNameError for an unknown name.
    """
    if Path(name_or_path).suffix == ".toml":
        return Path(name_or_path)
    if str(name_or_path) not in shipped_sweeps():
        scenario = (f"{str(name_or_path)!r} is a scenario, for `hierarchy run` and `hierarchy "
                    "compare`.") if is_shipped(str(name_or_path)) else ""
        raise UnknownNameError("sweep", str(name_or_path), shipped_sweeps(), scenario)
    return LIBRARY / f"{name_or_path}.toml"


def load_sweep(name_or_path: str | Path) -> Sweep:
    """Read a shipped sweep by name or a sweep file by path.

    Paths of scenario files in it are relative to the file, and absolute in the returned sweep.
    Raises ScenarioError, naming the file and the key, and UnknownNameError for an unknown name.
    """
    path = find(name_or_path)
    data = read_toml(path, "sweep file", ScenarioError)
    if not {"scenarios", "samples"} & data.keys() and {"robot", "extends", "control"} & data.keys():
        raise ScenarioError(f"{path} is a scenario, to be run by `hierarchy run {path}`")
    sweep = validated(Sweep, data, str(path))
    return sweep.model_copy(update={"scenarios": tuple(
        str(path.parent.resolve() / name) if name.endswith(".toml") or ".toml:" in name else name
        for name in sweep.scenarios)})
