"""What samples tell."""

import numpy as np
import pytest
from scipy.stats import PermutationMethod, wilcoxon

from scenarios.measure.statistics import EXACT, paired


@pytest.mark.parametrize("seed", range(5))
def test_the_p_value_is_that_of_all_signs_with_and_without_ties(seed):
    random = np.random.default_rng(seed)
    first = random.normal(size=9)
    second = first + 0.4 + random.normal(size=9)
    assert paired(first, second).p == pytest.approx(wilcoxon(second - first, method="exact")[1])
    second = np.random.default_rng(seed).integers(-2, 5, 11).astype(float)
    assert paired(np.zeros(11), second).p == pytest.approx(wilcoxon(
        second[second != 0.0], method=PermutationMethod(n_resamples=np.inf))[1])
    for count, method in ((EXACT, "exact"), (EXACT + 1, "asymptotic")):
        apart = 0.2 + random.normal(size=count)
        assert paired(np.zeros(count), apart).p == pytest.approx(wilcoxon(apart, method=method)[1])
        counts = random.integers(50, 900, count) + random.integers(0, 5, (2, count))
        assert paired(*counts / 1257.0).p == paired(*counts * 8.0).p  # shares tie to rounding
