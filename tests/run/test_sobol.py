"""Sobol points beside SciPy's."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import qmc

from coupling.run.sobol import sobol


@pytest.mark.parametrize("width", [1, 2, 3, 13, 150])
@pytest.mark.parametrize("seed", [0, 1, 2**40])
def test_points_are_scipys_to_the_last_bit(width, seed):
    expected = qmc.Sobol(width, scramble=True, rng=seed).random_base2(7)
    for count in (1, 2, 100, 128):
        assert np.array_equal(sobol(count, width, seed), expected[:count])


def test_a_box_without_points_has_none():
    assert sobol(0, 3, 1).shape == (0, 3)
