from math import inf, nan

import pytest

from hierarchy.allocation import allocate
from hierarchy.avoidance import SurveillanceAreas

AREAS = SurveillanceAreas(near=0.05, far=0.15, end_effector=0.1)
A, P, C = "avoidance", "position", "pointing"


@pytest.mark.parametrize(("body", "end", "cone", "order", "repulsion"), [
    # far from everything
    (0.20, 0.20, -1, (P,), False),
    (0.20, 0.20, +1, (P, C), False),
    (inf, inf, +1, (P, C), False),
    # the outer area: avoidance last
    (0.10, 0.20, -1, (P, A), False),
    (0.10, 0.20, +1, (P, C, A), False),
    (0.10, 0.08, +1, (P, C, A), True),
    # the inner area, the body nearer than the end effector: avoidance first
    (0.04, 0.20, -1, (A, P), False),
    (0.04, 0.20, +1, (A, P, C), False),
    (0.04, 0.08, +1, (A, P, C), True),
    # the inner area, the end effector nearer: avoidance second
    (0.04, 0.03, -1, (P, A), True),
    (0.04, 0.03, +1, (P, A, C), True),
    # ties
    (0.05, 0.20, -1, (A, P), False),       # D_minimal = eps_1 is near
    (0.15, 0.20, +1, (P, C, A), False),    # D_minimal = eps_2 is in the outer area
    (0.04, 0.04, -1, (P, A), True),        # equal distances: the end effector wins
    (0.20, 0.10, -1, (P,), True),          # D_ee = eps_ee repels
    (0.20, 0.20, 0.0, (P,), False),        # on the cone: not asked for
    (0.1500001, 0.1000001, -1, (P,), False),
    (0.0, 0.0, +1, (P, A, C), True),
    (0.20, 0.20, nan, (P,), False),        # no pointing task
])
def test_every_branch_and_tie_of_algorithm_1(body, end, cone, order, repulsion):
    assert allocate(body, end, cone, AREAS) == (order, repulsion)


def test_an_equality_pointing_task_is_always_in_the_stack():
    assert allocate(0.2, 0.2, -1.0, AREAS, always_point=True).order == (P, C)
    assert allocate(0.1, 0.2, -1.0, AREAS, always_point=True).order == (P, C, A)
    assert allocate(0.2, 0.2, nan, AREAS, always_point=True).order == (P,)


def test_one_surveillance_area_leaves_no_outer_one():
    areas = SurveillanceAreas(near=0.4, far=0.4, end_effector=0.4)
    assert allocate(0.4, 1.0, -1.0, areas).order == (A, P)
    assert allocate(0.41, 1.0, -1.0, areas).order == (P,)
