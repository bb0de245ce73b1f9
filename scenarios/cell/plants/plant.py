"""The interface of a plant."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Protocol

from numpy.typing import NDArray

from hierarchy.problem import Array


class Plant(Protocol):
    """A simulated robot that commands move.

    `q` (nq,) [rad] and `v` (n,) [rad/s] are measured values; `a` (n,) [rad/s^2] is the acceleration
    of the last command. `extra` has further signals of the last period to record, by name; its
    arrays stay the same objects. A plant may have a `fault`, which says why it cannot go on, such
    as a fall, and is None before.
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
        """Apply a command for one period: velocities or accelerations (n,), or joint torques."""


def fault_of(plant: Plant) -> str | None:
    """Return why a plant cannot go on, None if it can."""
    fault: str | None = getattr(plant, "fault", None)
    return fault


class Driven(Plant, Protocol):
    """A plant whose servos follow a reference (nq,) [rad], (n,) [rad/s]."""

    @property
    def reference_q(self) -> Array: ...  # noqa: D102

    @property
    def reference_v(self) -> Array: ...  # noqa: D102
