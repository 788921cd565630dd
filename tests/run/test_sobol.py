"""Sobol points against SciPy's."""

import numpy as np
import pytest
from scipy.stats import qmc

from coupling.run.sobol import sobol


@pytest.mark.parametrize("width", [1, 2, 6, 31, 32, 33])
@pytest.mark.parametrize("seed", [1, 11])
def test_points_are_those_of_scipy_to_the_last_bit(width, seed):
    for power in (1, 2, 4, 10):
        expected = qmc.Sobol(width, scramble=True, rng=seed).random_base2(power)
        np.testing.assert_array_equal(sobol(2**power, width, seed), expected)
        np.testing.assert_array_equal(sobol(2**power - 1, width, seed), expected[:-1])
