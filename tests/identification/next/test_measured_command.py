"""Runs are taken for exchanged by the robot of the last command, not by that of the file."""

from types import SimpleNamespace

import numpy as np
import pytest

from coupling.errors import LearnError
from coupling.identification.next.measured_command import require_measured_under

TIME = np.linspace(0.0, 10.0, 1001)  # [s]
WAVE = 5e-5 * np.sin(np.pi * TIME)[:, None] * np.array([1.0, 0.0, 0.0])  # [m]


def history(learned: float, of_file: float, measured: float) -> SimpleNamespace:
    """Return two runs that differ by so many waves: learned, of the file and measured.

    Log factors are 1 of the learned robot, of the second command, and 0 of the file's.
    """

    def simulated(number, x):
        share = number * (learned if x[0] else of_file)
        return SimpleNamespace(position=lambda time: share * WAVE)

    def unmodelled(number, x):
        seen = number * measured * WAVE + 1e-6 * np.random.default_rng(number).standard_normal(
            WAVE.shape
        )
        return np.hstack([seen - simulated(number, x).position(TIME), np.zeros_like(WAVE)])

    names = ("first", "second")
    seen = [np.full((len(TIME), 3), float(k)) for k in range(2)]
    return SimpleNamespace(
        runs=[SimpleNamespace(measured=SimpleNamespace(time=TIME), noise=1e-6)] * 2,
        sources=[
            SimpleNamespace(folder=name, measured=SimpleNamespace(name=name, position=position))
            for name, position in zip(names, seen, strict=True)
        ],
        simulated=simulated,
        unmodelled=unmodelled,
        factors_of=lambda number: np.array([float(number)]),
    )


def test_two_commands_that_are_the_same_to_the_learned_robot_may_leave_the_same():
    """The file's robot crosses its backlash between them, by 35 um rms; the one measured does not."""
    require_measured_under(history(learned=0.0, of_file=1.0, measured=0.0), 2e-6)


@pytest.mark.parametrize(
    ("measured", "words"), [(0.0, "are both of one run"), (-1.0, "are they exchanged")]
)
def test_runs_that_do_not_differ_as_the_learned_robot_are_refused(measured, words):
    with pytest.raises(LearnError, match=words):
        require_measured_under(history(learned=1.0, of_file=0.0, measured=measured), 2e-6)
    require_measured_under(history(learned=1.0, of_file=0.0, measured=1.0), 2e-6)
