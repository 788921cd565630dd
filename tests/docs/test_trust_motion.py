"""What the page on trust says of real robots in motion: its numbers against other ways to them."""

import numpy as np
import pytest
from line_case import line_case
from places import DOCS
from scipy.linalg import eigh

from coupling.identification.motion.recording import Recording
from docs.scripts import trust_breakthrough as breakthrough
from docs.scripts import trust_drives as drives
from docs.scripts import trust_motion as motion
from docs.scripts import trust_recordings as recordings

# Modified Denavit-Hartenberg parameters of the FANUC R-2000iC, its tool in the flange; stiffness of the
# joints as the authors have it [N m/rad].
ALPHA = np.array([0, -1, 0, -1, 1, -1]) * np.pi / 2
ALONG, OFFSET = [0, 0.312, 1.075, 0.225, 0, 0], [0.670, 0, 0, 1.280, 0, 0.215]
TOOL = [0.0069, 0.2453, 0.3193, 1.0]
STIFFNESS = np.array([933941.7645, 4129256.136, 1907534.091, 233204.6026, 404358.8275, 79618.1594])


def energy_of_a_newton(row: dict[str, str]) -> float:
    """Compliance along the drill over the mass that moves there, by the authors' links and frames."""
    angles = np.deg2rad([float(row[f"theta{k}"]) for k in range(1, 7)])
    model = [angles[0], angles[1] - np.pi / 2, -(angles[1] + angles[2]), *-angles[3:]]
    frames, frame = [], np.eye(4)
    for turn, a, d, angle in zip(ALPHA, ALONG, OFFSET, model, strict=True):
        ca, sa, ct, st = np.cos(turn), np.sin(turn), np.cos(angle), np.sin(angle)
        step = [
            [ct, -st, 0, a],
            [st * ca, ct * ca, -sa, -sa * d],
            [st * sa, ct * sa, ca, ca * d],
            [0, 0, 0, 1],
        ]
        frame = frame @ np.array(step)
        frames.append(frame)
    mass = np.zeros((6, 6))
    for last, link in enumerate(breakthrough.rows("inertia_parameters")):
        centre = [float(link[f"c{axis}"]) for axis in "xyz"]
        own = np.array([[float(link[f"I{a}{b}"]) for b in "xyz"] for a in "xyz"])
        turned, place = frames[last][:3, :3], (frames[last] @ [*centre, 1.0])[:3]
        axes, levers = jacobian(frames[: last + 1], place)
        mass += float(link["m"]) * levers.T @ levers + axes.T @ turned @ own @ turned.T @ axes
    drill = frame[:3, 1]  # y of the flange
    lever = drill @ jacobian(frames, (frame @ TOOL)[:3])[1]
    return float((lever @ (lever / STIFFNESS)) * (lever @ np.linalg.solve(mass, lever)))


def jacobian(frames: list[np.ndarray], place: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Axes of the joints before a place, and how they move it, (3, 6) each."""
    axes, levers = np.zeros((3, 6)), np.zeros((3, 6))
    for k, frame in enumerate(frames):
        axes[:, k] = frame[:3, 2]
        levers[:, k] = np.cross(frame[:3, 2], place - frame[:3, 3])
    return axes, levers


def test_the_thrust_is_that_of_the_authors_links_and_formula():
    """Of the shipped file's masses and geometry, and their stiffness; theory^2 is in (mm/s)^2."""
    tests = breakthrough.rows("breakthrough_surge")
    theory = np.array([float(row["theory^2"]) for row in tests])
    expected = 1e-3 * np.sqrt(theory / [energy_of_a_newton(row) for row in tests])
    np.testing.assert_allclose(breakthrough.drilled().thrust, expected, rtol=1e-4)


def test_all_postures_of_the_recordings_drill_in_one_direction():
    """A wrong sign or zero of a joint would turn them apart: joint 4 differs by up to 400 degrees."""
    postures = breakthrough.rows("breakthrough_initial")
    drills = [
        breakthrough.drill_axis(breakthrough.file_angles(row))
        for row in postures
        if row["no."].startswith("A")
    ]
    assert len(drills) == 5
    np.testing.assert_allclose(drills, np.tile(drills[0], (5, 1)), atol=1e-3)


def test_an_undamped_release_is_the_sum_of_its_modes():
    """Displacement of a linear robot whose force ends within T: modes, each averaged over T."""
    recorded = breakthrough.recorded("A-2")[0]
    ramp, newton = 0.01, 10.0
    release = breakthrough.Release(recorded.q, np.array([0.0, ramp]), np.array([newton, 0.0]), 0.0)
    (path,) = breakthrough.answers(breakthrough.robot(), [release.job(0.0)])
    linear = breakthrough.at_rest(recorded.q).linearise()
    squares, shapes = eigh(linear.stiffness, linear.mass)
    omega = np.sqrt(squares)
    given = newton * (shapes.T @ linear.forcing[:, :3] @ release.drill()) ** 2 / squares
    time = np.arange(len(path)) * 5e-4 - 0.02
    late = time > ramp
    mean = (np.sin(np.outer(time, omega)) - np.sin(np.outer(time - ramp, omega))) / (omega * ramp)
    along = (path - path[0]) @ release.drill()
    np.testing.assert_allclose(along[late], ((1.0 - mean) @ given)[late], atol=1e-3 * given.sum())
    surge = release.surge(path)
    rate = np.gradient((1.0 - mean) @ given, time)[late].max()
    assert surge.rate == pytest.approx(rate, rel=5e-3)


@pytest.mark.parametrize("name", ["A", "B"])
def test_a_recorded_motion_needs_the_torque_that_was_measured(name):
    """Signs, ratios and units of the file: a wrong one gives another slope than 1, on its axis."""
    found = recordings.torques(name)
    np.testing.assert_allclose(found.slope, 1.0, atol=0.15)
    assert np.all(found.error < 0.36 * found.size)


def test_a_lag_leaves_what_is_no_lag():
    """Of a start from rest that is late, and a ripple: its rms; an axis without encoder has none."""
    time = np.arange(4001) * 2.5e-3
    motor = np.column_stack([np.cos(time * rate) for rate in (1.0, 2.0, 3.0)])
    late = np.column_stack([np.cos((time - 3e-3) * rate) for rate in (1.0, 2.0)])
    ripple = 1e-4 * np.sin(2.0 * np.pi * 20.0 * time)
    link = np.column_stack([late[:, 0] + 0.5, late[:, 1] + ripple, np.full_like(time, np.nan)])
    recording = Recording("", time, motor, np.zeros_like(motor), link)
    assert motion.one_lag(recording) == pytest.approx(3e-3, rel=1e-3)
    left = motion.left_by_lag(recording, 3e-3)
    np.testing.assert_allclose(left, [0.0, 1e-4 / np.sqrt(2.0)], atol=1e-6)


def test_the_page_of_motion_says_the_same_of_what_was_predicted():
    """Where this fails after `make motion`: make trust."""
    cells = {
        page: next(line for line in (DOCS / page).read_text().splitlines() if line.startswith(row))
        .removeprefix(row)
        .split("|")[:3]
        for page, row in (
            ("motion.md", "| A | B, predicted |"),
            ("trust.md", "| the same, lines of the encoders fitted in B |"),
        )
    }
    assert cells["trust.md"] == cells["motion.md"]


def test_what_is_known_of_the_drives_is_corrected_and_what_is_not_stays(tmp_path):
    """A servo without integral holds friction by (friction / rate gain) / position gain of its angle."""
    robot = ('"icme2008"', '"kuka_kr300"')
    ideal = line_case(
        tmp_path,
        "native",
        (robot[0], f'{robot[1]}\ndrive = "ideal"'),
        ("[coupling]", '[plant]\ndrive = "servo"\n\n[coupling]'),
    )
    real = line_case(tmp_path, "native", (robot[0], f'{robot[1]}\ndrive = "servo"'))
    left = {name: deviation.maximum for name, deviation in drives.left_in(ideal, real).items()}
    assert left["ideal drives, corrected"] < 1e-6
    assert left["servos, corrected for them"] < 1e-6
    motors = [joint.drive for joint in real.robots[0].description.joints]
    held = [d.friction / (d.rate_gain * d.position_gain) for d in motors]
    reach = 2.0  # [m], of joints 1 to 3 to the tool
    assert 0.5 * held[2] < left["that command on the servos"] < 2.0 * sum(held[:3]) * reach
    for name in drives.OTHERS:
        assert 1e-5 < left[f"that command, {name}"] < left["that command on the servos"]
