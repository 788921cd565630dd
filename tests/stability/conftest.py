"""Fixtures of tests of stability."""

import pytest


@pytest.fixture(scope="module")
def coarse_charts():
    with pytest.MonkeyPatch.context() as patch:
        for name, value in (
            ("analysis.PLACES", 6),
            ("path_stability.PLACES", 6),
            ("chart._SPEEDS", 8),
            ("chart._DIRECTIONS", 4),
            ("chart._GRID", 2),
        ):
            patch.setattr(f"coupling.stability.{name}", value)
        yield
