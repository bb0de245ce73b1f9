"""Algorithm 1 of the letter: from measured distances to the order of the stack."""

from itertools import product
from typing import NamedTuple

from hierarchy.avoidance.measurement import SurveillanceAreas

AVOIDANCE, POSITION, POINTING = "avoidance", "position", "pointing"


class Allocation(NamedTuple):
    """Order of the stack, most important first, and whether eq. (30) adds the repulsion."""

    order: tuple[str, ...]
    repulsion: bool


def allocate(minimal_distance: float, end_effector_distance: float, cone_error: float,
             areas: SurveillanceAreas, always_point: bool = False) -> Allocation:
    """Return the order of the tasks "position", "pointing" and "avoidance" for one tick.

    Parameters
    ----------
    minimal_distance : D_minimal of the body's control points (31) [m], infinite if none.
    end_effector_distance : D_min of the end effector (22) [m], infinite if none.
    cone_error : cos(alpha_d) - cos(alpha); the pointing task is in the stack while it is positive,
        and never when it is NaN (no pointing task).
    areas : the thresholds eps_1, eps_2, eps_ee.
    always_point : the pointing task is an equality (16), in the stack at all times.

    Source: Algorithm 1. The published code differs only at exact ties: there avoidance is first
    also if both distances are equal, and the far area excludes eps_2.
    """
    near = minimal_distance <= areas.near
    first = near and minimal_distance < end_effector_distance
    second = near and not first
    point = cone_error > 0.0 or (always_point and cone_error == cone_error)
    last = areas.near < minimal_distance <= areas.far
    return _ALLOCATIONS[first, second, point, last, end_effector_distance <= areas.end_effector]


# One object per case, so that the loop creates none.
_ALLOCATIONS = {
    (first, second, point, last, repulsion): Allocation(
        (*(AVOIDANCE,) * first, POSITION, *(AVOIDANCE,) * second, *(POINTING,) * point,
         *(AVOIDANCE,) * last), repulsion)
    for first, second, point, last, repulsion in product((False, True), repeat=5)}
