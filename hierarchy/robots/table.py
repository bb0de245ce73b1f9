"""A serial arm of revolute joints as its Denavit-Hartenberg table."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class DHTable:
    """Standard Denavit-Hartenberg parameters: T_i = Rz(q_i) Tz(d_i) Tx(a_i) Rx(alpha_i).

    One entry a joint: a, d [m], alpha [deg]; position limits +-`range` [deg]; `velocity` [rad/s];
    `effort` limits [N m]; `mass` [kg] of the link that the joint moves. Each link is taken as a
    uniform rod of radius `radius` [m] between its joint and the next. `control_points` are (joint,
    offset [m] along the joint's own z axis measured from its DH origin, ...): see `ControlPoint`.
    """

    name: str
    a: tuple[float, ...]
    d: tuple[float, ...]
    alpha: tuple[float, ...]
    range: tuple[float, ...]
    velocity: tuple[float, ...]
    effort: tuple[float, ...]
    mass: tuple[float, ...]
    radius: float
    control_points: tuple[tuple[str, tuple[float, float, float]], ...]
