"""A resolution of levels that give continues from its memory, and solves no more than it must."""

import numpy as np

from hierarchy import Hierarchy
from solvers import certify, make


def hand_and_posture(reach):
    """Two tasks that give, of which the second is met while the first leaves it room."""
    rng = np.random.default_rng(4)
    A, B = rng.normal(size=(2, 6)), rng.normal(size=(2, 6))
    return Hierarchy.from_levels(
        [(np.eye(6), np.full(6, -1.0), np.full(6, 1.0)), (A, np.full(2, reach)),
         (B, np.full(2, 0.1)), (np.eye(6), np.full(6, 0.2))], give=[0.0, 0.1, 0.1, 0.0])


def test_a_memory_gives_the_same_answer_in_fewer_iterations():
    for reach in (0.3, 8.0):
        h, resolver = hand_and_posture(reach), make("hcod")
        cold = resolver.solve(h)
        warm = resolver.solve(h, cold.memory)
        np.testing.assert_allclose(warm.x, cold.x, atol=1e-12)
        assert warm.iterations <= cold.iterations
        assert certify(h, warm.x, witnesses=warm.witnesses).certified
        assert warm.active.shape == (h.m,)


def test_levels_that_are_met_share_a_witness_and_others_have_their_own():
    met, missed = (make("hcod").solve(hand_and_posture(reach)) for reach in (0.3, 8.0))
    np.testing.assert_array_equal(*met.witnesses)
    assert not np.array_equal(*missed.witnesses)


def test_a_memory_of_another_kind_is_taken_for_none():
    h, resolver = hand_and_posture(8.0), make("hcod")
    for memory in (np.zeros(0), np.full(7, np.nan), resolver.solve(h.changed(give=None)).memory):
        np.testing.assert_allclose(resolver.solve(h, memory).x, resolver.solve(h).x, atol=1e-9)
