"""Paths that begin or end in motion are reported, others are not."""

from __future__ import annotations

import numpy as np
import pytest

from coupling.path.histories import ToolPath
from coupling.path.path_ends import ends_in_motion, is_near_moving_end

_TIME = np.linspace(0.0, 10.0, 201)
_SMOOTH = (
    _TIME**3 * (10.0 * 20.0**2 - 15.0 * 20.0 * _TIME + 6.0 * _TIME**2) / 20.0**5
)  # half of a ramp


def _path(x: np.ndarray) -> ToolPath:
    pose = np.zeros((len(x), 7))
    pose[:, 0], pose[:, 6] = x, 1.0
    return ToolPath(_TIME, pose)


@pytest.mark.parametrize(
    ("x", "verbs"),
    [
        (0.05 * _TIME, ["begins at 0.05 m/s", "ends at 0.05 m/s"]),
        (_SMOOTH, ["ends at"]),
        (_SMOOTH[::-1], ["begins at"]),
        (_TIME**3 * (10.0 - _TIME) ** 3, []),
        (np.zeros(201), []),
    ],
)
def test_every_end_in_motion_is_told(x, verbs):
    told = ends_in_motion(_path(x), ("forming",))
    assert len(told) == len(verbs)
    assert all(verb in text for verb, text in zip(verbs, told, strict=True))


def test_only_what_is_near_such_an_end_is_explained_by_it():
    starts = _path(_SMOOTH[::-1])
    assert [is_near_moving_end(starts, time) for time in (0.01, 5.0, 9.99)] == [True, False, False]
