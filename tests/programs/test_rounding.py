"""Rounded programs: what their texts hold, without a text."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from coupling.programs.languages import LANGUAGES
from coupling.programs.program import Configuration, ProgramMove, RobotProgram


def random_program(language: str, targets: str, seed: int) -> RobotProgram:
    """Return a program of random targets with times of whole milliseconds."""
    rng = np.random.default_rng(seed)
    times = 1e-3 * rng.integers(8, 60, 40)
    angles = rng.uniform(-3.0, 3.0, (41, 6))
    motion = {"spline": "spline", "straight": "joint"}[LANGUAGES[language].between]
    moves = [ProgramMove("joint", joints=tuple(angles[0]))]
    if targets == "joints":
        moves += [
            ProgramMove(motion, joints=tuple(row), duration=time)
            for row, time in zip(angles[1:], times, strict=True)
        ]
    else:
        turns = Rotation.random(41, rng=seed).as_quat(canonical=True)
        poses = np.hstack([rng.uniform(-2.0, 2.0, (41, 3)), turns])
        posture = Configuration(False, False, 1, tuple(angles[0]))
        moves.append(ProgramMove("linear", tuple(poses[0]), speed=0.01, configuration=posture))
        moves += [
            ProgramMove(
                motion.replace("joint", "linear"), tuple(pose), duration=time, configuration=posture
            )
            for pose, time in zip(poses[1:], times, strict=True)
        ]
    base = (*rng.uniform(-2.0, 2.0, 3), *Rotation.random(rng=seed + 1).as_quat(canonical=True))
    tool = (*rng.uniform(-0.3, 0.3, 3), *Rotation.random(rng=seed + 2).as_quat(canonical=True))
    return RobotProgram("WAY", tuple(moves), base, tool)


@pytest.mark.parametrize("targets", ["cartesian", "joints"])
@pytest.mark.parametrize("name", ["krl", "rapid", "fanuc"])
def test_a_rounded_program_has_the_numbers_of_its_text(name, targets):
    """Written and read again by the whole chain; what is left is a controller's single precision."""
    for seed in range(5):
        language = LANGUAGES[name]
        program = random_program(name, targets, seed)
        rounded = language.rounded(program)
        again = language.read(language.write(program))
        rows, expected = (
            np.array([getattr(move, "pose" if targets == "cartesian" else "joints") for move in p])
            for p in (rounded.timed, again.timed)
        )
        if targets == "cartesian":
            sides = np.sign(np.sum(rows[:, 3:] * expected[:, 3:], axis=1))
            rows[:, 3:] *= sides[:, None]
        np.testing.assert_allclose(rows, expected, rtol=0.0, atol=3e-9)
        times, expected_times = (
            np.cumsum([move.duration for move in p.timed[1:]]) for p in (rounded, again)
        )
        np.testing.assert_allclose(times, expected_times, rtol=1e-9)
