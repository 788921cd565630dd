"""Parameters of robots that are known, learned from measurements of their simulation."""

import json
import tomllib
from dataclasses import replace

import numpy as np
import pytest
from circling_robots import NOISE, Robots, stored_fit
from line_case import changed_text
from places import CASES
from scipy.spatial.transform import Rotation

from coupling.errors import LearnError
from coupling.files.robot_file import load_robot
from coupling.identification.next.inputs import next_case_text
from coupling.identification.runs.backlash_selection import select_backlashes
from coupling.identification.runs.effect import ParameterEffect
from coupling.identification.runs.judge import mostly_in_backlash
from coupling.identification.runs.learning import learn
from coupling.identification.runs.measurement import Measurement
from coupling.identification.runs.parameters import LEARNED, factors_between, learnable
from coupling.identification.runs.problem import FramePrior
from coupling.identification.runs.slow_part import SlowPart
from coupling.identification.runs.source import read_source
from coupling.inverse.diagnosis import diagnose
from coupling.inverse.inversion import MovingRobot
from coupling.path.histories import WrenchHistory
from coupling.robot.parameters import apply_values, robot_parameters, scaled_values
from coupling.run.fmu_pool import FmuPool
from coupling.run.stored_run import read_run
from elastic_robot.drive import Drive


@pytest.fixture(scope="module")
def robots(example, models):
    return Robots(example, models, seconds=5.0, rate=0.4)


def less_mean(deviation: np.ndarray) -> float:
    off = deviation - deviation.mean(axis=0)
    return float(np.sqrt(np.mean(np.sum(off**2, axis=1))))


def test_the_next_command_of_a_learned_robot_leaves_a_fifth_at_most(robots):
    """Backlash 20 % more, damping 25 % less, stiffness 4 % more, seen in a frame and by a clock that are
    off; these are found to a tenth, and gears that reverse to 5 %."""
    truth = robots.factors(backlash=1.2, damping=0.75, stiffness=1.04)
    where = robots.moved(truth)
    shift, turn, late = np.array([2e-4, -1e-4, 3e-4]), np.array([1e-4, -2e-4, 2e-4]), 0.012
    one = robots.measured(where + shift + np.cross(turn, where - where.mean(axis=0)))
    one = replace(
        one, measured=replace(one.measured, time=one.measured.time + late).at_rows(np.arange(1200))
    )
    found = stored_fit(robots.problem(one), np.zeros(len(truth)))
    x, frame = found.x[: len(truth)], found.x[len(truth) :]
    np.testing.assert_allclose(frame[3:6], turn, atol=8e-5)
    np.testing.assert_allclose(frame[6], -late, atol=1e-3)
    # What constant stiffness does is not told apart from the frame's shift.
    np.testing.assert_allclose(frame[:3], shift, atol=6e-5)
    first = [p.name for p in robots.parameters].index("joint[1].backlash")
    assert x[first] == pytest.approx(np.log(1.2), abs=0.05)
    before = less_mean(where - robots.desired)
    after = less_mean(robots.moved(truth, robots.commanded(x)) - robots.desired)
    assert before > 3e-5
    assert after < 0.2 * before


def test_a_robot_that_is_its_file_is_found_as_it_is_and_what_is_not_told_is_unsure(robots):
    """Damping of a gear that stays on its flank has no effect."""
    one = robots.measured(robots.moved(robots.factors()), every=3)
    problem, start = robots.problem(one), np.zeros(len(robots.parameters))
    found = stored_fit(problem, start)
    names = [p.name for p in robots.parameters]
    assert np.all(np.abs(found.x[: len(start)]) < 2.0 * found.deviation)
    assert np.abs(found.x[: len(start)]).max() < 0.1
    assert found.deviation[names.index("joint[2].damping")] > 0.25
    assert found.deviation[names.index("joint[1].backlash")] < 0.1
    assert found.noise == pytest.approx(NOISE, rel=0.1)
    assert np.all(found.half > 1.9 * found.deviation)


def test_the_first_seconds_of_a_pass_are_those_of_the_whole(robots):
    """Simulated a little beyond it, as the clock may be off; by the gears' equation as well."""
    truth = robots.factors(backlash=1.2)
    whole = robots.measured(robots.moved(truth))
    part = whole.until(3.0)
    time = part.measured.time
    assert time[-1] == pytest.approx(3.0)
    np.testing.assert_array_equal(part.wrench.instants, part.desired.time)
    assert 3.1 < part.wrench.time[-1] < 4.0
    paths = [one.simulated(robots.fmu, robots.robot).position(time) for one in (whole, part)]
    np.testing.assert_allclose(paths[1], paths[0], atol=1e-8)
    assert whole.until(100.0).measured.time[-1] == whole.measured.time[-1]
    effect = ParameterEffect(robots.robot, "backlash", robots.parameters, whole)
    of_part, of_whole = (effect(truth, own) for own in (time, whole.measured.time))
    np.testing.assert_allclose(of_part, of_whole[: len(time)], rtol=0.0, atol=1e-12)


def test_the_gears_equation_tells_what_the_simulation_does_on_flanks(robots, example):
    """Without backlash everything is linear: to 1 % of a simulation with one per cent more stiffness."""
    joints = tuple(replace(joint, backlash=0.0) for joint in example.joints)
    tight = Robots(replace(example, joints=joints), robots.models)
    assert {p.kind for p in tight.parameters} == {"stiffness", "damping"}
    one = tight.measured(tight.desired)
    time, mean, zero = (
        one.measured.time,
        SlowPart.of(one.measured.time),
        np.zeros(len(tight.parameters)),
    )
    inner = (mean.time > 1.0) & (mean.time < 8.0)
    effect = ParameterEffect(tight.robot, "backlash", tight.parameters, one)
    columns = mean(effect(zero, time))[inner]
    turned = replace(one, measured=replace(one.measured, rotation=Rotation.identity(len(time))))
    here = turned.simulated(tight.fmu, tight.robot).pose(time)
    for k, parameter in enumerate(tight.parameters):
        if parameter.kind == "damping":  # nanometres
            continue
        stiffer = tight.described(np.where(np.arange(len(zero)) == k, 0.01, 0.0))
        moved = mean(turned.simulated(tight.fmu, stiffer).pose(time) - here)[inner]
        for part in (slice(3), slice(3, 6)):
            off = 0.01 * columns[:, part, k] - moved[:, part]
            assert np.abs(off).max() < 0.01 * np.abs(moved[:, part]).max()


@pytest.mark.parametrize("factor", [1e-9, 0.6, 1.0, 1.5])
def test_backlash_is_dropped_where_there_is_none_and_stays_where_it_is_another(robots, factor):
    """With stiffness off by 10 % beside it, which moves the tool as well."""
    for stiffness in (0.9, 1.1):
        truth = robots.factors(backlash=factor, stiffness=stiffness)
        run = robots.measured(robots.moved(truth))
        effect = ParameterEffect(robots.robot, "backlash", robots.parameters, run)
        selected = select_backlashes(run, effect, robots.robot, robots.fmu)
        assert set(selected.values()) == ({0.0} if factor < 0.1 else set())
        assert ("joint[1].backlash" in selected) == (factor < 0.1)


@pytest.mark.parametrize("factor", [1e-9, 0.6, 1.0, 1.5])
def test_backlash_that_the_file_does_not_state_is_added_where_there_is_some(
    robots, example, factor
):
    joints = tuple(replace(joint, backlash=0.0) for joint in example.joints)
    tight = replace(example, joints=joints)
    parameters = learnable(tight, "backlash", "ideal")
    for stiffness in (0.9, 1.1):
        truth = robots.factors(backlash=factor, stiffness=stiffness)
        run = robots.measured(robots.moved(truth))
        effect = ParameterEffect(tight, "backlash", parameters, run)
        selected = select_backlashes(run, effect, tight, robots.fmu)
        assert bool(selected) == (factor > 0.1)
        assert all(7e-5 < backlash < 4e-4 for backlash in selected.values())


def test_learned_factors_make_a_robot_and_come_back_from_it(robots):
    rng = np.random.default_rng(2)
    x = rng.uniform(-0.3, 0.3, len(robots.parameters))
    other = robots.described(x)
    np.testing.assert_allclose(factors_between(robots.parameters, other), x, atol=1e-12)
    again = {p.name: p.value for p in robot_parameters(other, "backlash", LEARNED)}
    assert again == pytest.approx(scaled_values(robots.parameters, x))
    kinds = {p.kind for p in robot_parameters(robots.robot, "linear", LEARNED)}
    assert kinds == {"stiffness", "damping"}


def test_gears_that_float_for_most_of_a_path_are_named(robots):
    free = replace(robots.wanted, wrench=WrenchHistory.none(robots.wanted.path.time))
    loads = (diagnose(MovingRobot(robots.robot, "backlash"), w) for w in (free, robots.wanted))
    alone, pushed = (mostly_in_backlash(gears, 5.0) for gears in loads)
    assert alone.startswith("the gears of joints 1, 4")
    assert pushed == ""


def test_a_plant_of_factors_stays_the_robot_that_it_was(tmp_path):
    data = {"robot": {"description": "icme2008"}, "plant": {"backlash_factor": [1.2]}}
    found = tomllib.loads(next_case_text(data, tmp_path / "learned.toml"))
    assert found["robot"]["description"] == str(tmp_path / "learned.toml")
    assert found["plant"] == {"backlash_factor": [1.2], "description": "icme2008"}
    assert data["robot"]["description"] == "icme2008"


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """A small contour of the cone, on a plant with another backlash."""
    from command_line import command as program

    folder = tmp_path_factory.mktemp("learn")
    text = changed_text(
        CASES / "cone.toml",
        ("radius_m       = 0.06", "radius_m       = 0.03"),
        ("depth_m        = 0.01", "depth_m        = 0.0005"),
    )
    text += "\n[plant]\nbacklash_factor = 1.15\n"
    case = folder / "small.toml"
    case.write_text(text)
    program("compensate", case, "-o", folder / "run", exits=0)
    stored = read_source(folder / "run", Measurement("", np.zeros(1), np.zeros((1, 3)))).stored
    rng = np.random.default_rng(0)
    seen = stored.plant.position[0] + 5e-6 * rng.standard_normal(stored.plant.position[0].shape)
    rows = np.column_stack([stored.plant.time, seen])
    np.savetxt(folder / "m.csv", rows, delimiter=",", header="time,x,y,z", comments="")
    return folder


def test_the_command_learns_and_commands_again(command, run):
    """What was learned is a robot file, and its command leaves less on the plant that is not told."""
    inputs = run / "out_inputs"
    target = inputs / "robot.toml"
    done = command("learn", run / "run", run / "m.csv", "-v", "-o", run / "out", exits=0)
    assert "Torques and reversals of the gears" in done.stdout
    assert "backlash reversals" in done.stdout
    told = json.loads((inputs / "learned.json").read_text())
    by_name = {entry["name"]: entry for entry in told["parameters"]}
    robot = load_robot(target)
    assert robot.joints[0].backlash == pytest.approx(by_name["joint[1].backlash"]["written"])
    text = target.read_text()
    assert "learned, m.csv" in text
    assert "95 %:" in text
    page = (inputs / "next.html").read_text()
    for part in ("left0", "Torques and reversals of the gears", "joint[1].backlash"):
        assert part in page
    runs = [read_run(folder).first for folder in (run / "run", run / "out")]
    before, after = (less_mean(r.plant.position[0] - r.desired.position[0]) for r in runs)
    assert after < 0.5 * before


def test_a_robot_without_the_backlash_of_its_file_is_learned_to_have_none(run, example, tmp_path):
    """Its stiffness is 10 % less; what is left with the file that is written is a tenth."""
    joints = tuple(
        replace(j, backlash=0.0, stiffness=0.9 * j.stiffness if j.stiffness else None)
        for j in example.joints
    )
    source = read_source(run / "run", Measurement("", np.zeros(1), np.zeros((1, 3))))
    stored = source.stored
    with FmuPool("native") as models:
        fmu = models.of(replace(example, joints=joints), "backlash").fmu
        path = fmu.simulate(stored.joints, stored.wrench, "dynamic")
        seen = path.position[0] + NOISE * np.random.default_rng(1).standard_normal(
            path.position[0].shape
        )
        source = replace(source, measured=Measurement("m.csv", path.time, seen))
        learned = learn([source], FramePrior(), models)
    left = learned.result.left_m
    assert left.learned < 0.1 * left.robot_file
    assert learned.robot.joints[0].backlash == 0.0
    target = tmp_path / "robot.toml"
    target.write_text(learned.text(source.file, "m.csv", target))
    assert load_robot(target) == replace(learned.robot, name=load_robot(target).name)


def test_the_command_refuses_in_one_sentence(command, run, tmp_path):
    few = tmp_path / "few.csv"
    few.write_text("\n".join((run / "m.csv").read_text().splitlines()[:300]))
    none, out = tmp_path / "none.csv", tmp_path / "out"
    for arguments, words in (
        (["learn", run / "run", "-o", out], "pairs of a run folder"),
        (["learn", run, run / "m.csv", "-o", out], "result.json"),
        (["learn", run / "run", none, "-o", out], "none.csv: cannot be read"),
        (["learn", run / "run", few, "-o", out], "at least 2 s"),
        (["learn", run / "run", few, "-o", few / "out"], "few.csv"),
        (["learn", run / "run", run / "m.csv", "-o", run / "run"], "another folder than"),
    ):
        done = command(*arguments, exits=2)
        assert words in done.stderr
        assert len(done.stderr.strip().splitlines()) == 1
    assert list(tmp_path.iterdir()) == [few]


def test_passes_of_two_robots_are_not_learned_together(run, tmp_path, example):
    from coupling.identification.runs.source import require_comparable

    source = read_source(run / "run", Measurement("", np.zeros(1), np.zeros((1, 3))))
    longer = replace(example, tcp_position=(0.31, 0.0, 0.0))
    softer = apply_values(
        example, scaled_values(learnable(example, "backlash", "ideal"), np.full(27, -0.1))
    )
    require_comparable([source, replace(source, robot=softer)])
    with pytest.raises(LearnError, match="another one"):
        require_comparable([source, replace(source, robot=longer)])
    lifted = tuple((a, 3e3 * a) for a in (-1.0, 0.0, 1.0))

    def balanced(robot):
        joints = (replace(robot.joints[0], balancer=lifted), *robot.joints[1:])
        return replace(robot, joints=joints)

    source = replace(source, robot=balanced(example))
    require_comparable([source, replace(source, robot=balanced(softer))])
    with pytest.raises(LearnError, match="another one"):
        require_comparable([source, replace(source, robot=example)])

    def rubbing(friction, lost):
        drive = Drive(
            inertia=1.0, position_gain=20.0, rate_gain=300.0, friction=friction, stribeck=lost
        )
        return replace(
            example, joints=(replace(example.joints[0], drive=drive), *example.joints[1:])
        )

    source = replace(source, robot=rubbing(10.0, 0.2))
    require_comparable([source, replace(source, robot=rubbing(11.0, 0.19999999999999998))])
    with pytest.raises(LearnError, match="another one"):
        require_comparable([source, replace(source, robot=rubbing(11.0, 0.21))])
    rigid = tuple(
        replace(j, stiffness=None, damping=0.0, backlash=0.0, tilt=()) for j in example.joints
    )
    with pytest.raises(LearnError, match="a rigid one"):
        require_comparable([replace(source, robot=replace(example, joints=rigid))])
    with pytest.raises(LearnError, match="torque_curve"):
        require_comparable([source, replace(source, torque_curve="linear")])
