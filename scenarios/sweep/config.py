"""The validated form of a sweep file: which scenarios, which resolvers, what is sampled."""

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
    """A sweep file that cannot be used; names file and key."""


class _Section(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid", strict=False)


class Uniform(_Section):
    """Any value between two, all alike."""

    uniform: tuple[Finite, Finite]

    @model_validator(mode="after")
    def _in_order(self) -> Self:
        if self.uniform[0] > self.uniform[1]:
            raise ValueError(f"{self.uniform[0]:g} is above {self.uniform[1]:g}")
        return self

    def draw(self, chance: np.random.Generator, own: Value | None) -> Value:
        """Return a number between the two."""
        return float(chance.uniform(*self.uniform))

    def __str__(self) -> str:
        return f"uniform from {self.uniform[0]:g} to {self.uniform[1]:g}"


class Normal(_Section):
    """Normal, with a mean and a deviation."""

    normal: tuple[Finite, NotNegative]

    def draw(self, chance: np.random.Generator, own: Value | None) -> Value:
        """Return a number; any is possible."""
        return float(chance.normal(*self.normal))

    def __str__(self) -> str:
        return f"normal, mean {self.normal[0]:g}, deviation {self.normal[1]:g}"


class Choice(_Section):
    """One of some values of any kind, all alike."""

    choice: Annotated[tuple[Any, ...], Field(min_length=1)]

    def draw(self, chance: np.random.Generator, own: Value | None) -> Value:
        """Return one of the values."""
        value: Value = self.choice[int(chance.integers(len(self.choice)))]
        return value

    def __str__(self) -> str:
        return f"one of {', '.join(map(str, self.choice))}"


class Around(_Section):
    """The scenario's own value, a number or an array, with something uniform added to each entry.

    `around` is the largest that is added, the same for all entries or one for each.
    """

    around: NotNegative | tuple[NotNegative, ...]

    def draw(self, chance: np.random.Generator, own: Value | None) -> Value:
        """Return the own value with offsets; raises ValueError where it has no numbers."""
        try:
            centre = np.array(own, dtype=float)
            offset = np.broadcast_to(np.array(self.around), centre.shape)
        except (TypeError, ValueError):
            raise ValueError(f"around = {self.around} does not fit the scenario's own value "
                             f"{own!r}") from None
        if not np.isfinite(centre).all():
            raise ValueError(f"the scenario has no value of its own to be around, but {own!r}")
        value: Value = (centre + chance.uniform(-offset, offset)).tolist()
        return value

    def __str__(self) -> str:
        width = f"{self.around:g}" if isinstance(self.around, float) else str(list(self.around))
        return f"the scenario's own ± {width}, uniform"


class Integers(_Section):
    """A whole number from the first to the last, both included; for seeds."""

    integers: tuple[int, int]

    @model_validator(mode="after")
    def _in_order(self) -> Self:
        if self.integers[0] > self.integers[1]:
            raise ValueError(f"{self.integers[0]} is above {self.integers[1]}")
        return self

    def draw(self, chance: np.random.Generator, own: Value | None) -> Value:
        """Return a whole number of the range."""
        return int(chance.integers(self.integers[0], self.integers[1], endpoint=True))

    def __str__(self) -> str:
        return f"whole numbers from {self.integers[0]} to {self.integers[1]}"


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
    """Bring nested tables, as TOML makes of keys with dots, back to one level."""
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
    """Every scenario, under every resolver, with every one of `samples` draws of the parameters.

    `parameters` are dotted keys of a scenario, a number for a place in a list. What is drawn
    depends on `seed`, the number of the sample and the key alone: more samples, scenarios,
    resolvers or parameters leave those there were as they are. `duration` [s] goes before that of
    the scenarios.
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
    """Names of the sweeps that come with the package."""
    return tuple(sorted(path.stem for path in LIBRARY.glob("*.toml")))


def find(name_or_path: str | Path) -> Path:
    """Return the file of a shipped sweep by name, or the path as given.

    Raises UnknownNameError for a name that is not shipped.
    """
    if Path(name_or_path).suffix == ".toml":
        return Path(name_or_path)
    if str(name_or_path) not in shipped_sweeps():
        raise UnknownNameError("sweep", str(name_or_path), shipped_sweeps())
    return LIBRARY / f"{name_or_path}.toml"


def load_sweep(name_or_path: str | Path) -> Sweep:
    """Read a shipped sweep by name or a sweep file by path.

    Paths of scenario files in it are relative to it, and absolute in what is returned. Raises
    SweepError, naming the file and the key, and UnknownNameError for a name that is not shipped.
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
    """Leave out the kind that pydantic puts between a parameter and the key in its table.

    And what it puts after that: which form of the value it tried.
    """
    return loc[:2] + loc[3:4] if loc[0] == "parameters" and len(loc) > 3 else loc
