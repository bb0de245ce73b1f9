"""Distributions of values at dotted keys of a scenario, as a file gives them."""

from __future__ import annotations

from typing import Annotated, Any, ClassVar

import numpy as np
from pydantic import AfterValidator, BeforeValidator, Field

from scenarios.config.sections import Finite, NotNegative, OneOf, Section, Whole

Value = bool | int | float | str | list[Any]


def _in_order(bounds: tuple[float, float]) -> tuple[float, float]:
    if bounds[0] > bounds[1]:
        raise ValueError(f"{bounds[0]:g} is above {bounds[1]:g}")
    return bounds


class Uniform(Section):
    """A number from a uniform distribution."""

    uniform: Annotated[tuple[Finite, Finite], AfterValidator(_in_order)]
    """Lower and upper bound."""

    def draw(self, chance: np.random.Generator, own: Value | None) -> Value:
        """Return a number within the bounds."""
        return float(chance.uniform(*self.uniform))

    def __str__(self) -> str:
        return f"uniform from {self.uniform[0]:g} to {self.uniform[1]:g}"


class Normal(Section):
    """A number from a normal distribution."""

    normal: tuple[Finite, NotNegative]
    """Mean and standard deviation."""

    def draw(self, chance: np.random.Generator, own: Value | None) -> Value:
        """Return a number; it is not bounded."""
        return float(chance.normal(*self.normal))

    def __str__(self) -> str:
        return f"normal, mean {self.normal[0]:g}, standard deviation {self.normal[1]:g}"


class Choice(Section):
    """One of several values of any type."""

    choice: Annotated[tuple[Any, ...], Field(min_length=1)]
    """They are equally likely."""

    def draw(self, chance: np.random.Generator, own: Value | None) -> Value:
        """Return one of the values."""
        value: Value = self.choice[int(chance.integers(len(self.choice)))]
        return value

    def __str__(self) -> str:
        return f"one of {', '.join(map(str, self.choice))}"


class Around(Section):
    """The scenario's value plus a uniform offset in each entry."""

    around: NotNegative | tuple[NotNegative, ...]
    """Largest offset, of all or of each."""

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
    """An integer, for seeds."""

    integers: Annotated[tuple[Whole, Whole], AfterValidator(_in_order)]
    """First and last one."""

    def draw(self, chance: np.random.Generator, own: Value | None) -> Value:
        """Return an integer of the range."""
        return int(chance.integers(self.integers[0], self.integers[1], endpoint=True))

    def __str__(self) -> str:
        return f"integers from {self.integers[0]} to {self.integers[1]}"


class _ByKey(OneOf):
    """Selects the distribution by the key of a table."""

    wants: ClassVar[str] = "expected a table with one of"

    def kinds(self, section: type[Section]) -> tuple[str, ...]:
        """Return the key of a distribution."""
        return tuple(section.model_fields)

    def kind_of(self, table: dict[str, Any]) -> Any:
        """Return the first key that is one of a distribution."""
        return next((key for key in table if key in _KEYS), None)


_KEYS = ("uniform", "normal", "choice", "around", "integers")
Distribution = Annotated[Uniform | Normal | Choice | Around | Integers, _ByKey()]


def flat(table: Any, above: str = "") -> Any:
    """Flatten nested tables, which TOML makes of dotted keys, to one level."""
    if not isinstance(table, dict):
        return table
    found: dict[str, Any] = {}
    for key, value in table.items():
        if isinstance(value, dict) and value and not any(key in _KEYS for key in value):
            found |= flat(value, f"{above}{key}.")
        else:
            found[f"{above}{key}"] = value
    return found


Parameters = Annotated[dict[str, Distribution], BeforeValidator(flat)]
