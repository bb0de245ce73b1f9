"""The validated form of a sweep file: scenarios, resolvers and sampled parameters."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any, Self

import numpy as np
from pydantic import (
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Discriminator,
    Field,
    Tag,
    ValidationError,
    model_validator,
)

from hierarchy.errors import HierarchyError, UnknownNameError
from scenarios.files import read_toml

LIBRARY = Path(__file__).parents[1] / "library" / "sweeps"

Finite = Annotated[float, Field(allow_inf_nan=False)]
NotNegative = Annotated[float, Field(ge=0.0, allow_inf_nan=False)]
Value = bool | int | float | str | list[Any]


class SweepError(HierarchyError):
    """An invalid sweep file; the message names the file and the key."""


class _Section(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid", strict=False)


class Uniform(_Section):
    """A number from a uniform distribution."""

    uniform: tuple[Finite, Finite]

    @model_validator(mode="after")
    def _in_order(self) -> Self:
        if self.uniform[0] > self.uniform[1]:
            raise ValueError(f"{self.uniform[0]:g} is above {self.uniform[1]:g}")
        return self

    def draw(self, chance: np.random.Generator, own: Value | None) -> Value:
        """Return a number within the bounds."""
        return float(chance.uniform(*self.uniform))

    def __str__(self) -> str:
        return f"uniform from {self.uniform[0]:g} to {self.uniform[1]:g}"


class Normal(_Section):
    """A number from a normal distribution, given by mean and standard deviation."""

    normal: tuple[Finite, NotNegative]

    def draw(self, chance: np.random.Generator, own: Value | None) -> Value:
        """Return a number; it is not bounded."""
        return float(chance.normal(*self.normal))

    def __str__(self) -> str:
        return f"normal, mean {self.normal[0]:g}, standard deviation {self.normal[1]:g}"


class Choice(_Section):
    """One of several values of any type, each equally likely."""

    choice: Annotated[tuple[Any, ...], Field(min_length=1)]

    def draw(self, chance: np.random.Generator, own: Value | None) -> Value:
        """Return one of the values."""
        value: Value = self.choice[int(chance.integers(len(self.choice)))]
        return value

    def __str__(self) -> str:
        return f"one of {', '.join(map(str, self.choice))}"


class Around(_Section):
    """The scenario's own value, a number or an array, plus a uniform offset in each entry.

    `around` is the largest offset, one for all entries or one for each.
    """

    around: NotNegative | tuple[NotNegative, ...]

    def draw(self, chance: np.random.Generator, own: Value | None) -> Value:
        """Return the own value with offsets; raises ValueError if it is not numeric."""
        try:
            centre = np.array(own, dtype=float)
            offset = np.broadcast_to(np.array(self.around), centre.shape)
        except (TypeError, ValueError):
            raise ValueError(f"around = {self.around} does not fit the scenario's own value "
                             f"{own!r}") from None
        if not np.isfinite(centre).all():
            raise ValueError(f"the scenario's own value is {own!r}, not a number")
        value: Value = (centre + chance.uniform(-offset, offset)).tolist()
        return value

    def __str__(self) -> str:
        width = f"{self.around:g}" if isinstance(self.around, float) else str(list(self.around))
        return f"the scenario's own ± {width}, uniform"


class Integers(_Section):
    """An integer from the first to the last, both included; for seeds."""

    integers: tuple[int, int]

    @model_validator(mode="after")
    def _in_order(self) -> Self:
        if self.integers[0] > self.integers[1]:
            raise ValueError(f"{self.integers[0]} is above {self.integers[1]}")
        return self

    def draw(self, chance: np.random.Generator, own: Value | None) -> Value:
        """Return an integer of the range."""
        return int(chance.integers(self.integers[0], self.integers[1], endpoint=True))

    def __str__(self) -> str:
        return f"integers from {self.integers[0]} to {self.integers[1]}"


_KINDS = ("uniform", "normal", "choice", "around", "integers")


def _kind(table: Any) -> str | None:
    if isinstance(table, dict):
        return next((kind for kind in _KINDS if kind in table), None)
    return type(table).__name__.lower()


Distribution = Annotated[
    Annotated[Uniform, Tag("uniform")] | Annotated[Normal, Tag("normal")]
    | Annotated[Choice, Tag("choice")] | Annotated[Around, Tag("around")]
    | Annotated[Integers, Tag("integers")],
    Discriminator(_kind, custom_error_type="distribution",
                  custom_error_message=f"expected a table with one of {', '.join(_KINDS)}")]


def _flat(table: Any, above: str = "") -> Any:
    """Flatten nested tables, which TOML makes of dotted keys, to one level."""
    if not isinstance(table, dict):
        return table
    flat: dict[str, Any] = {}
    for key, value in table.items():
        if isinstance(value, dict) and value and _kind(value) is None:
            flat |= _flat(value, f"{above}{key}.")
        else:
            flat[f"{above}{key}"] = value
    return flat


class Sweep(_Section):
    """Every scenario under every resolver, with each of `samples` draws of the parameters.

    `parameters` are dotted keys of a scenario, with numbers as list indices. A drawn value depends
    only on `seed`, the sample's number and the key: adding samples, scenarios, resolvers or
    parameters does not change existing samples. `duration` [s] overrides that of the scenarios.
    """

    name: Annotated[str, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9_.-]*$")]
    title: str = ""
    scenarios: Annotated[tuple[str, ...], Field(min_length=1)]
    resolvers: Annotated[tuple[str, ...], Field(min_length=1)]
    duration: Annotated[float, Field(gt=0.0, allow_inf_nan=False)] | None = None
    samples: Annotated[int, Field(ge=1)]
    seed: Annotated[int, Field(ge=0)] = 0
    parameters: Annotated[dict[str, Distribution], BeforeValidator(_flat)] = Field(
        default_factory=dict)


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
        raise UnknownNameError("sweep", str(name_or_path), shipped_sweeps())
    return LIBRARY / f"{name_or_path}.toml"


def load_sweep(name_or_path: str | Path) -> Sweep:
    """Read a shipped sweep by name or a sweep file by path.

    Paths of scenario files in it are relative to the file, and absolute in the returned sweep.
    Raises SweepError, naming the file and the key, and UnknownNameError for an unknown name.
    """
    path = find(name_or_path)
    data = read_toml(path, "sweep file", SweepError)
    try:
        sweep = Sweep.model_validate(data)
    except ValidationError as error:
        said = dict.fromkeys(_say(path, one) for one in error.errors())
        raise SweepError("\n".join(said)) from error
    return sweep.model_copy(update={"scenarios": tuple(
        str(path.parent.resolve() / name) if name.endswith(".toml") else name
        for name in sweep.scenarios)})


def _say(path: Path, error: Any) -> str:
    loc = [str(part) for part in error["loc"]]
    if error["type"] == "extra_forbidden":
        *above, _ = loc
        known = [".".join(above)] if above else list(Sweep.model_fields)
        return f"{path}: {UnknownNameError('key', '.'.join(_without_kind(loc)), known)}"
    where = ".".join(_without_kind(loc)) or "file"
    value = "" if isinstance(error["input"], dict) else f", got {error['input']!r}"
    return f"{path}: {where}: {error['msg'].removeprefix('Value error, ')}{value}"


def _without_kind(loc: list[str]) -> list[str]:
    """Drop the distribution's kind that pydantic inserts into the location of an error.

    The form of the value that it tried is dropped too.
    """
    return loc[:2] + loc[3:4] if loc[0] == "parameters" and len(loc) > 3 else loc
