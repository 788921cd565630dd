"""Samples that this program simulates itself."""

from __future__ import annotations

from contextlib import nullcontext

import pytest

from coupling.errors import HostError, StudyError
from coupling.study import robot_pool
from coupling.study.robot_pool import RETRIES, simulate_here


@pytest.mark.parametrize("ends", [RETRIES, RETRIES + 1])
def test_a_robot_that_ends_its_process_is_tried_three_times_more(monkeypatch, ends):
    """Each sample anew: what is said where it ends once more is a sentence."""
    tried = []

    class Ending:
        def sample(self, number, values):
            tried.append(number)
            if tried.count(number) <= ends:
                raise HostError("the process that runs the FMU has ended")
            return number, values

    monkeypatch.setattr(robot_pool, "RobotPool", lambda work: nullcontext(Ending()))
    points = {0: [1.0], 7: [2.0]}
    if ends > RETRIES:
        with pytest.raises(StudyError, match=r"ended its process in 4 tries of one sample"):
            list(simulate_here(None, points))
        assert tried == [0] * 4
    else:
        assert list(simulate_here(None, points)) == [(0, [1.0]), (7, [2.0])]
        assert tried == [0] * 4 + [7] * 4
