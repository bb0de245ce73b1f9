"""Distributions of values at dotted keys of a scenario, as a file gives them."""

from collections.abc import Iterator
from typing import Annotated, Any

import numpy as np
from pydantic import AfterValidator, BeforeValidator, Field

from scenarios.config.sections import Finite, NotNegative, Section, Whole

Value = bool | int | float | str | list[Any]


def _in_order(bounds: tuple[float, float]) -> tuple[float, float]:
    if bounds[0] > bounds[1]:
        raise ValueError(f"{bounds[0]:g} is above {bounds[1]:g}")
    return bounds


class Distribution(Section):
    """The distribution of a key, in its unit, for `hierarchy compare --starts`: one of these."""

    uniform: Annotated[tuple[Finite, Finite], AfterValidator(_in_order)] | None = None
    """A number from a uniform distribution: lower and upper bound."""
    normal: tuple[Finite, NotNegative] | None = None
    """A number from a normal distribution, not bounded: mean and standard deviation."""
    choice: Annotated[tuple[Any, ...], Field(min_length=1)] | None = None
    """One of several values of any type, equally likely."""
    around: NotNegative | tuple[NotNegative, ...] | None = None
    """The scenario's value plus a uniform offset in each entry: the largest, of all or of each."""
    integers: Annotated[tuple[Whole, Whole], AfterValidator(_in_order)] | None = None
    """An integer, for seeds: first and last one."""

    def _wrong(self) -> Iterator[str]:
        given = [key for key in _KEYS if getattr(self, key) is not None]
        if len(given) != 1:
            yield f"expected a table with one of {', '.join(_KEYS)}, got {given or 'none'}"

    def draw(self, chance: np.random.Generator, own: Value | None) -> Value:
        """Return a value; raises ValueError if it is to be around an `own` that is no number."""
        value: Value
        if self.uniform:
            value = float(chance.uniform(*self.uniform))
        elif self.normal:
            value = float(chance.normal(*self.normal))
        elif self.choice:
            value = self.choice[int(chance.integers(len(self.choice)))]
        elif self.integers:
            value = int(chance.integers(*self.integers, endpoint=True))
        else:
            value = self._around(chance, own)
        return value

    def _around(self, chance: np.random.Generator, own: Value | None) -> Any:
        if own is None:
            raise ValueError(f"around = {self.around} needs a value in the scenario; give it one")
        try:
            centre = np.array(own, dtype=float)
            offset = np.broadcast_to(np.array(self.around), centre.shape)
        except (TypeError, ValueError):
            raise ValueError(f"around = {self.around} does not fit the scenario's own value "
                             f"{own!r}") from None
        if not np.isfinite(centre).all():
            raise ValueError(f"the scenario's own value is {own!r}, not a number")
        return (centre + chance.uniform(-offset, offset)).tolist()

    def __str__(self) -> str:
        if self.uniform:
            return f"uniform from {self.uniform[0]:g} to {self.uniform[1]:g}"
        if self.normal:
            return f"normal, mean {self.normal[0]:g}, standard deviation {self.normal[1]:g}"
        if self.choice:
            return f"one of {', '.join(map(str, self.choice))}"
        if self.integers:
            return f"integers from {self.integers[0]} to {self.integers[1]}"
        around = self.around
        width = str(list(around)) if isinstance(around, tuple) else f"{around:g}"
        return f"the scenario's own ± {width}, uniform"


_KEYS = tuple(Distribution.model_fields)


def flat(table: Any, above: str = "") -> Any:
    """Flatten nested tables, which TOML makes of dotted keys, to one level.

    A table in a section that has no table in it is a distribution, whatever its keys.
    """
    if not isinstance(table, dict):
        return table
    found: dict[str, Any] = {}
    for key, value in table.items():
        if isinstance(value, dict) and value and not any(key in _KEYS for key in value) and (
                not above or any(isinstance(one, dict) for one in value.values())):
            found |= flat(value, f"{above}{key}.")
        else:
            found[f"{above}{key}"] = value
    return found


Parameters = Annotated[dict[str, Distribution], BeforeValidator(flat)]
