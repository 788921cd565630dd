"""Measured orientations beside positions: what they tell, and how they are brought onto the run."""

from dataclasses import replace

import numpy as np
import pytest
from circling_robots import Robots, stored_fit
from scipy.spatial.transform import Rotation

from coupling.errors import LearnError
from coupling.identification.runs.alignment import aligned
from coupling.identification.runs.measurement import Measurement, SimulatedPath
from coupling.identification.runs.residual import Residual
from coupling.path.histories import ToolPath

NOISE, NOISE_TURN = 1e-5, 2e-5
PROBE = Rotation.from_rotvec([1.0, -0.5, 2.0])
FRAME = Rotation.from_rotvec([3e-4, -2e-4, 1e-4])


@pytest.fixture(scope="module")
def robots(example, models):
    return Robots(example, models)


def seen_of(robots: Robots, path: ToolPath, every: int = 2, shift: float = 0.0) -> Measurement:
    """What a probe that is mounted anyhow tells of a path, in a frame that is turned a little."""
    rng, rows = np.random.default_rng(7), np.arange(0, len(robots.time), every)
    center = path.position[0].mean(axis=0)
    position = center + FRAME.apply(path.position[0][rows] - center)
    position = position + NOISE * rng.standard_normal(position.shape)
    turns = Rotation.from_rotvec(NOISE_TURN * rng.standard_normal(position.shape))
    held = turns * FRAME * path.rotations[0][rows] * PROBE
    return Measurement("measured.csv", robots.time[rows] + shift, position, held)


def test_orientations_narrow_what_positions_hardly_tell(robots):
    """Gear 4 hardly moves a TCP near its axis, but turns the tool: its backlash is told twice as well at
    least, what was hidden lies within three deviations, and nothing is told much worse."""
    truth = robots.factors(backlash=1.15, damping=0.85, stiffness=1.05)
    path = robots.taken(truth)
    seen = aligned(seen_of(robots, path), robots.taken(0.0 * truth), own_frame=False)
    found, errors, deviations = 0.0 * truth, [], []
    for own in (replace(seen, rotation=None), seen):
        problem = robots.problem(replace(robots.measured(path.position[0]), measured=own))
        fit = stored_fit(problem, found)
        assert fit.converged
        found = fit.x[: len(truth)]
        errors.append(np.abs(found - truth))
        deviations.append(fit.deviation)
    narrower = deviations[0] / deviations[1]
    of = {parameter.name: k for k, parameter in enumerate(robots.parameters)}
    assert narrower[of["joint[4].backlash"]] > 2.0
    assert narrower[of["joint[1].backlash"]] > 1.5
    assert narrower[of["joint[5].damping"]] > 1.2
    assert narrower.min() > 0.8
    assert np.all(errors[1] < 3.0 * deviations[1])
    for name in ("joint[1].backlash", "joint[4].backlash"):
        assert errors[1][of[name]] < 0.5 * errors[0][of[name]]


def test_a_row_is_linear_in_frame_clock_and_probe(robots):
    """Derivatives against central differences, in the unit in which turns count as lengths."""
    truth = np.zeros(len(robots.parameters))
    path = robots.taken(truth)
    seen = aligned(seen_of(robots, path, every=20), path, own_frame=False)
    one = replace(robots.measured(path.position[0]), measured=seen)
    residual, own = Residual(one), 1e-4 * np.arange(10.0)
    simulated = one.simulated(robots.fmu, robots.robot)
    inner = np.flatnonzero((seen.time > 1.0) & (seen.time < 8.0))
    exact = residual.by_frame(simulated, seen.time + own[6], 10)[inner]
    # A turn of the frame turns about the measurement's middle; a millionth of each is small.
    for k in range(10):
        step = np.where(np.arange(10) == k, 1e-6, 0.0)
        ahead, behind = (residual.rows(simulated, own + sign * step)[inner] for sign in (1, -1))
        got = (behind - ahead) / 2e-6
        np.testing.assert_allclose(got, exact[:, :, k], atol=2e-3 * np.abs(exact[:, :, k]).max())


def test_the_noise_of_orientations_is_found_and_sets_what_a_radian_counts(robots):
    path = robots.taken(np.zeros(len(robots.parameters)))
    seen = aligned(seen_of(robots, path), path, own_frame=False)
    residual = Residual(replace(robots.measured(path.position[0]), measured=seen))
    moved, turned = residual.noise
    assert moved == pytest.approx(NOISE, rel=0.08)
    assert turned == pytest.approx(NOISE_TURN, rel=0.08)
    assert residual.lever == pytest.approx(NOISE / NOISE_TURN, rel=0.12)


def test_a_probe_that_is_mounted_anyhow_is_told_from_the_tool(robots):
    """Its turn on the tool goes: what is left are the frame and the noise."""
    path = robots.taken(np.zeros(len(robots.parameters)))
    for own_frame in (False, True):
        found = aligned(seen_of(robots, path), path, own_frame)
        assert found.rotation is not None
        off = (found.rotation * SimulatedPath(path).rotation(found.time).inv()).magnitude()
        assert np.sqrt(np.mean(off**2)) < 1e-4


def test_orientations_that_do_not_follow_the_tool_are_refused_in_a_sentence(robots):
    path = robots.taken(np.zeros(len(robots.parameters)))
    seen = seen_of(robots, path)
    assert seen.rotation is not None
    spun = Rotation.from_rotvec(np.outer(0.1 * seen.time, [0.0, 0.0, 1.0]))
    with pytest.raises(LearnError, match="expected the tool's orientations to 20 mrad"):
        aligned(replace(seen, rotation=seen.rotation * spun), path, own_frame=False)
