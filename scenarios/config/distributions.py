"""Distributions of values at dotted keys of a scenario, as a file gives them."""

from __future__ import annotations

from typing import Annotated, Any, Self

import numpy as np
from pydantic import BeforeValidator, Discriminator, Field, Tag, model_validator

from scenarios.config.sections import Finite, NotNegative, Section, Whole

Value = bool | int | float | str | list[Any]


class Uniform(Section):
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


class Normal(Section):
    """A number from a normal distribution, given by mean and standard deviation."""

    normal: tuple[Finite, NotNegative]

    def draw(self, chance: np.random.Generator, own: Value | None) -> Value:
        """Return a number; it is not bounded."""
        return float(chance.normal(*self.normal))

    def __str__(self) -> str:
        return f"normal, mean {self.normal[0]:g}, standard deviation {self.normal[1]:g}"


class Choice(Section):
    """One of several values of any type, each equally likely."""

    choice: Annotated[tuple[Any, ...], Field(min_length=1)]

    def draw(self, chance: np.random.Generator, own: Value | None) -> Value:
        """Return one of the values."""
        value: Value = self.choice[int(chance.integers(len(self.choice)))]
        return value

    def __str__(self) -> str:
        return f"one of {', '.join(map(str, self.choice))}"


class Around(Section):
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


class Integers(Section):
    """An integer from the first to the last, both included; for seeds."""

    integers: tuple[Whole, Whole]

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


Parameters = Annotated[dict[str, Distribution], BeforeValidator(_flat)]
