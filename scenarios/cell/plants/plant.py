"""What every plant has."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Protocol

from numpy.typing import NDArray

from hierarchy.problem import Array


class Plant(Protocol):
    """Something that commands move.

    `q` (nq,) [rad] and `v` (n,) [rad/s] are what the controller is told; `a` (n,) [rad/s^2] is the
    acceleration that the last command meant. `extra` has by name what else is to be recorded of the
    period that `act` went through last; its arrays stay the same objects.
    """

    @property
    def q(self) -> Array: ...  # noqa: D102

    @property
    def v(self) -> Array: ...  # noqa: D102

    @property
    def a(self) -> Array: ...  # noqa: D102

    @property
    def extra(self) -> Mapping[str, NDArray[Any]]: ...  # noqa: D102

    def act(self, command: Array) -> None:
        """Apply a command (n,), a velocity or an acceleration, for one period."""


class Driven(Plant, Protocol):
    """A plant that follows its reference (nq,) [rad], (n,) [rad/s] as well as it can."""

    @property
    def reference_q(self) -> Array: ...  # noqa: D102

    @property
    def reference_v(self) -> Array: ...  # noqa: D102
