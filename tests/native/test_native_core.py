"""The C core against Pinocchio, the Python model and the reference solutions of other engines."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from conftest import reference
from native_core import CURVES, LANES, Core, CoreError, library
from places import REFERENCE
from random_robots import hardly_loaded, make_robot

from coupling.fmu_export.robot_text import robot_text
from elastic_robot import gauss
from elastic_robot.chain import build_chain
from elastic_robot.dynamics import Dynamics
from elastic_robot.errors import EquilibriumError, RobotFileError
from elastic_robot.kinematics import base_from_tool, pose_of, tcp_jacobian
from elastic_robot.parameters import Parameters
from elastic_robot.robot import ElasticRobot
from elastic_robot.torque_curves import TORQUE_CURVES
from elastic_robot.trajectory import HeldCommand, Trajectory, read_trajectory

NO_LOAD = np.zeros(6)
LOAD = np.array([200.0, -150.0, -1000.0, 10.0, 20.0, -5.0])
REFERENCE_CURVES = {"nobacklash": "linear", "backlash": "backlash"}


def _assert_relative(found, expected, tolerance):
    """Largest difference relative to the largest entry."""
    scale = np.abs(expected).max(initial=0.0)
    np.testing.assert_allclose(found, expected, rtol=0, atol=tolerance * scale)


@pytest.mark.parametrize("plain", [True, False])
def test_a_thousand_random_chains_agree_with_pinocchio(plain):
    """1 to 8 joints, random axes: loads, mass matrix, Jacobian, pose and static torque to 1e-12.

    Angles near the reference take the series for sines, the others libm.
    """
    rng = np.random.default_rng(0)
    for seed in range(500):
        robot = make_robot(seed + 500 * plain, 1 + seed % 8)
        core, chain = Core(robot, plain), build_chain(robot)
        dynamics = Dynamics(chain, np.array(robot.gravity))
        angles, m = chain.model.nv, chain.elastic_count
        spread = 0.09 if seed % 3 else 3.0
        theta = rng.uniform(-3.0, 3.0, angles) + rng.uniform(-spread, spread, (LANES, angles))
        reference_angles = theta[0].copy()
        rate, acceleration = rng.normal(size=(2, LANES, angles))
        wrench = rng.normal(size=6) * [1e3, 1e3, 1e3, 1e2, 1e2, 1e2] * bool(seed % 5)
        loaded = wrench if wrench.any() else None
        expected = dynamics.loads(theta, rate, acceleration, wrench)
        found = core.loads(reference_angles, theta, rate, acceleration, loaded, m)
        _assert_relative(found, expected, 1e-12)
        found = core.chain(theta[0].copy(), wrench, m)
        pose = pose_of(base_from_tool(chain, dynamics.data, theta[0]))
        np.testing.assert_allclose(found["pose"], pose, rtol=0, atol=1e-12)
        _assert_relative(found["jacobian"], tcp_jacobian(chain, dynamics.data, theta[0]), 1e-12)
        _assert_relative(found["mass"], dynamics.mass_matrix(theta[0]), 1e-12)
        _assert_relative(found["torque"], dynamics.static_torque(theta[0], wrench), 1e-12)
        gradient = dynamics.static_torque_gradient(theta[0], wrench)
        _assert_relative(found["gradient"], gradient, 1e-11)


TABLE = tuple((0.5e-4 * k, 40.0 * np.sinh(0.5 * k)) for k in range(-4, 6))


@pytest.mark.parametrize("kind", CURVES)
def test_curves_agree_with_python(example, kind):
    """Torque, slope and inverse on every branch, with a joint's own table among them."""
    joints = (replace(example.joints[0], torque_table=TABLE), *example.joints[1:])
    robot = replace(example, joints=joints)
    core, curve = Core(robot), TORQUE_CURVES[kind].build(Parameters.of(robot))
    x = np.random.default_rng(1).uniform(-6e-4, 6e-4, (200, 11))
    torque, slope, deflection = (values.T for values in core.curve(kind, x.T.copy()))
    np.testing.assert_allclose(torque, curve.torque(x), rtol=1e-12, atol=1e-9)
    np.testing.assert_allclose(slope, curve.slope(x), rtol=1e-11, atol=1e-4)
    expected = [curve.deflection(row) for row in curve.torque(x)]
    np.testing.assert_allclose(deflection, expected, rtol=1e-9, atol=1e-13)
    for side in (-1, 0, 1):
        region = np.where(np.isfinite(curve.half_width), side, 1)
        branch = curve.in_region(region)
        torque = core.curve(kind, x.T.copy(), side)[0].T
        switching = np.isfinite(curve.half_width)
        expected = branch.torque(x)
        np.testing.assert_allclose(
            torque[:, switching], expected[:, switching], rtol=1e-12, atol=1e-9
        )


def test_the_gauss_coefficients_are_those_of_the_python_stepper():
    """Node by node, and the eigenvectors of A1 as an identity."""

    def constant(name, *shape):
        values = (np.ctypeslib.ctypes.c_double * int(np.prod(shape))).in_dll(library(), name)
        return np.array(values).reshape(shape)

    for name, expected in (
        ("node", gauss.NODES),
        ("once", gauss.A1),
        ("twice", gauss.A2),
        ("end_rate", gauss.B1),
        ("end_position", gauss.B2),
        ("end_acceleration", gauss.B0),
        ("bernstein", gauss.BERNSTEIN),
    ):
        found = constant(f"er_gauss_{name}", *expected.shape)
        np.testing.assert_allclose(found, expected, rtol=0, atol=2e-15)
    eigen, to, back = (
        constant(f"er_gauss_{name}_re", *shape) + 1j * constant(f"er_gauss_{name}_im", *shape)
        for name, shape in (("eigen", (2,)), ("to", (2, 4)), ("back", (2, 4)))
    )
    rebuilt = sum(2.0 * (eigen[p] * np.outer(back[p], to[p])).real for p in range(2))
    np.testing.assert_allclose(rebuilt, gauss.A1, rtol=0, atol=1e-14)
    np.testing.assert_allclose(to @ back.T, np.eye(2), rtol=0, atol=1e-14)
    powers = constant("er_gauss_power_from_stage", 4, 4)
    np.testing.assert_allclose(
        gauss.NODES[:, None] ** np.arange(4) @ powers, np.eye(4), rtol=0, atol=1e-14
    )


def test_forward_kinematics_of_ten_poses(example):
    robot = replace(example, gravity=(0.0, 0.0, 0.0))
    core = Core(robot)
    for row, expected in zip(reference("poses"), reference("a_fk"), strict=True):
        core.reset("backlash", 0.0, row[1:], NO_LOAD, quasistatic=True)
        out = core.outputs(11)
        np.testing.assert_allclose(out["tcp"], expected[1:8], rtol=0, atol=1e-12)
        np.testing.assert_allclose(out["x"], 0.0, rtol=0, atol=1e-12)


@pytest.mark.parametrize("curve", REFERENCE_CURVES)
@pytest.mark.parametrize("load", ["gravity", "wrench"])
def test_static_equilibrium_of_ten_poses(example, load, curve):
    core, wrench = Core(example), LOAD if load == "wrench" else NO_LOAD
    table = reference(f"b_static_{load}_{curve}")
    for row, expected in zip(reference("poses"), table, strict=True):
        core.reset(REFERENCE_CURVES[curve], 0.0, row[1:], wrench, quasistatic=True)
        out = core.outputs(11)
        found = np.append(out["tcp"], out["x"])
        np.testing.assert_allclose(found, expected[1:], rtol=0, atol=1e-12)


@pytest.mark.parametrize("curve", REFERENCE_CURVES)
def test_step_response(example, curve):
    """-2000 N on 0.1 <= t < 0.3 s to 1e-10 m."""
    expected, core = reference(f"c_step_{curve}"), Core(example)
    q, force = [0.0, -0.3, 0.5, 0.0, 0.6, 0.0], np.array([0.0, 0.0, -2000.0, 0.0, 0.0, 0.0])
    core.reset(REFERENCE_CURVES[curve], 0.0, q, NO_LOAD)
    error = 0.0
    for row in expected[1:]:
        core.step(row[0], q, force if 0.1005 < row[0] < 0.3005 else NO_LOAD)
        error = max(error, np.abs(core.outputs(11)["tcp"][:3] - row[1:4]).max())
    assert error < 1e-10


@pytest.mark.parametrize("plain", [True, False])
@pytest.mark.parametrize(("curve", "limit"), [("nobacklash", 1e-8), ("backlash", 1e-6)])
def test_whole_iso_path_at_default_settings(example, curve, limit, plain):
    expected, core = reference(f"d_iso_{curve}_10ms"), Core(example, plain)
    path = REFERENCE / "iso_path_joints.npz"
    core.reset(REFERENCE_CURVES[curve], 0.0, np.zeros(6), NO_LOAD, path=path)
    rows = core.run(expected[:, 0].copy(), 11)
    assert np.abs(rows[:, :3] - expected[:, 1:4]).max() < limit


def test_error_falls_with_the_tolerance(example):
    """12 s with backlash: over four decades of the tolerance the error falls by three at least."""
    expected = reference("d_iso_backlash_10ms")[:1201]
    errors = []
    for tolerance in (1e-4, 1e-6, 1e-8):
        core = Core(example)
        path = REFERENCE / "iso_path_joints.npz"
        core.reset("backlash", 0.0, np.zeros(6), NO_LOAD, path=path, tolerance=tolerance)
        rows = core.run(expected[:, 0].copy(), 11)
        errors.append(np.abs(rows[:, :3] - expected[:, 1:4]).max())
        assert errors[-1] < tolerance
    assert errors[0] > 1e3 * errors[2]


@pytest.mark.parametrize("kind", CURVES)
def test_random_robots_rest_as_in_python(kind):
    """Equilibrium and all outputs; where Python finds none the core finds none."""
    rng = np.random.default_rng(7)
    for seed in range(60):
        robot = make_robot(seed, 1 + seed % 8)
        n = len(robot.joints)
        q, wrench = rng.uniform(-3.0, 3.0, n), rng.normal(size=6) * 300.0 * bool(seed % 3)
        command = HeldCommand(0.0, q, np.zeros(n), np.zeros(n))
        python, core = ElasticRobot(robot, kind, quasistatic=True), Core(robot)
        try:
            python.reset(0.0, command, wrench)
        except EquilibriumError:
            with pytest.raises(CoreError, match="no static equilibrium"):
                core.reset(kind, 0.0, q, wrench, quasistatic=True)
            continue
        core.reset(kind, 0.0, q, wrench, quasistatic=True)
        m = python.chain.elastic_count
        out = core.outputs(m)
        np.testing.assert_allclose(out["x"], python.deflection(), rtol=0, atol=1e-13)
        np.testing.assert_allclose(out["tcp"], python.tcp(), rtol=0, atol=1e-13)
        np.testing.assert_allclose(out["rigid"], python.rigid(), rtol=0, atol=1e-13)
        np.testing.assert_allclose(out["deviation"], python.deviation(), rtol=0, atol=1e-12)
        upper = python.compliance()[np.triu_indices(3)]
        np.testing.assert_allclose(out["compliance"], upper, rtol=1e-9, atol=1e-18)


@pytest.mark.parametrize("kind", CURVES)
def test_hardly_loaded_gears_rest_as_in_python(example, kind):
    """A gear rests where its load of some 1e-6 N m vanishes, for gradients down to 1e-3 N m/rad."""
    rng, core = np.random.default_rng(1), Core(example)
    python = ElasticRobot(example, kind, quasistatic=True)
    for _ in range(300):
        q, wrench = hardly_loaded(rng, 6)
        python.reset(0.0, HeldCommand(0.0, q, np.zeros(6), np.zeros(6)), wrench)
        core.reset(kind, 0.0, q, wrench, quasistatic=True)
        np.testing.assert_allclose(core.outputs(11)["x"], python.deflection(), rtol=0, atol=1e-9)


@pytest.mark.parametrize("kind", CURVES)
def test_random_robots_move_as_in_python(kind):
    """Random trajectories without rates (a cubic spline) under random wrenches, to 2e-8 m.

    Both work at a tolerance of 1e-8 m.
    """
    rng = np.random.default_rng(11)
    for seed in range(6):
        robot = make_robot(seed, 2 + seed)
        n = len(robot.joints)
        q, wrench = rng.uniform(-2.0, 2.0, n), rng.normal(size=6) * 100.0
        python, core = ElasticRobot(robot, kind, tolerance=1e-8), Core(robot)
        command = HeldCommand(0.0, q, np.zeros(n), np.zeros(n))
        try:
            python.reset(0.0, command, NO_LOAD)
        except EquilibriumError:
            continue
        core.reset(kind, 0.0, q, NO_LOAD, tolerance=1e-8)
        for end in (0.003, 0.02, 0.021, 0.06):
            load = wrench if end < 0.05 else NO_LOAD
            python.step(end, HeldCommand(python.time, q, np.zeros(n), np.zeros(n)), load)
            core.step(end, q, load)
            out = core.outputs(python.chain.elastic_count)
            np.testing.assert_allclose(out["tcp"], python.tcp(), rtol=0, atol=2e-8)
            np.testing.assert_allclose(out["velocity"], python.velocity(), rtol=0, atol=2e-5)


def _trajectory(core: Core, path, n: int) -> None:
    core.reset("linear", 0.0, np.zeros(n), NO_LOAD, path=path, quasistatic=True)


def test_trajectories_agree_with_python(example, tmp_path):
    """Quintic Hermite and clamped cubic, from CSV, NPZ and deflated NPZ, with columns in any order."""
    rng = np.random.default_rng(2)
    time = np.cumsum(rng.uniform(0.01, 0.1, 40))
    time -= time[0]
    times = np.sort(np.append(rng.uniform(0.0, time[-1], 300), time))
    for blocks in (("q",), ("q", "qd", "qdd")):
        columns = ["note", *[f"{b}{i}" for b in blocks for i in range(6, 0, -1)], "time"]
        table = rng.normal(size=(40, len(columns)))
        table[:, -1] = time
        np.savez(tmp_path / "t.npz", columns=columns, data=table)
        np.savez_compressed(tmp_path / "c.npz", columns=columns, data=np.asfortranarray(table))
        header = ", ".join(columns)
        np.savetxt(tmp_path / "t.csv", table, "%.17g", ",", header=header, comments="")
        python = read_trajectory(tmp_path / "t.npz", 6)
        for name in ("t.npz", "c.npz", "t.csv"):
            core = Core(example)
            _trajectory(core, tmp_path / name, 6)
            for found, expected in zip(core.drives(times, 6), python.at(times), strict=True):
                _assert_relative(found, expected, 1e-11)
            for jump in (0.0, 1e3):
                for at in times[:-1:7]:
                    kink = min(python.next_kink(float(at), jump), time[-1])
                    assert core.next_kink(at, time[-1], jump) == kink


def test_kinks_of_a_smooth_trajectory_are_none(example, tmp_path):
    time = np.linspace(0.0, 1.0, 11)
    columns = ["time", *[f"q{i + 1}" for i in range(6)]]
    cubic = time**2 * (3.0 - 2.0 * time)  # rests at both ends: reproduced by the clamped spline
    np.savez(tmp_path / "t.npz", columns=columns, data=np.column_stack([time, *[cubic] * 6]))
    core = Core(example)
    _trajectory(core, tmp_path / "t.npz", 6)
    assert core.next_kink(0.0, 1.0, 1e-6) == 1.0
    assert isinstance(read_trajectory(tmp_path / "t.npz", 6), Trajectory)


BROKEN = {
    "time,q1\n0,0\n1,0\n1,1\n": "time falls from 1 to 1 s at sample 3",
    "time,q1\n0,0\n1,nan\n": "line 3: found 'nan'; needed is a finite number",
    "time,q1\n0,0\n1,1e999\n": "line 3: found '1e999'",
    "time,q2\n0,0\n1,1\n": "no column 'q1'; it has time, q2",
    "t,q1\n0,0\n1,1\n": "no column 'time'",
    "time,q1\n0,0\n": "1 samples; needed are at least 2",
    "time,q1,qd1\n0,0,0\n1,1,0\n": "qd but no qdd",
    "time,q1\n0,abc\n": "found 'abc'",
    "time,q1\n0,0,0\n1,0,0\n": "2 column names over 3 columns",
    "time,q1\n0;0\n1;0\n": "needed is a comma",
    "": "no column 'time'",
}


@pytest.mark.parametrize("text", BROKEN)
def test_broken_trajectories_are_refused_with_file_and_reason(tmp_path, text):
    file = tmp_path / "broken.csv"
    file.write_text(text)
    with pytest.raises(CoreError) as caught:
        _trajectory(Core(make_robot(1, 1)), file, 1)
    assert str(file) in str(caught.value)
    assert BROKEN[text] in str(caught.value)


def test_a_broken_archive_is_refused_at_every_length(tmp_path):
    """Cut anywhere, and with any single byte changed: no crash, and a sentence where it is refused."""
    np.savez_compressed(tmp_path / "t.npz", columns=["time", "q1"], data=np.eye(2))
    content = (tmp_path / "t.npz").read_bytes()
    file, rng = tmp_path / "broken.npz", np.random.default_rng(0)
    for length in range(len(content)):
        file.write_bytes(content[:length])
        with pytest.raises(CoreError):
            _trajectory(Core(make_robot(1, 1)), file, 1)
    for at in range(len(content)):
        changed = bytearray(content)
        changed[at] ^= rng.integers(1, 256)
        file.write_bytes(bytes(changed))
        assert "broken.npz" in _refusal(file)


def _refusal(file: Path) -> str:
    """The sentence a trajectory is refused with; its name where it is taken."""
    try:
        _trajectory(Core(make_robot(1, 1)), file, 1)
    except CoreError as error:
        return str(error)
    return file.name


def test_times_outside_the_trajectory_are_refused(tmp_path):
    (tmp_path / "t.csv").write_text("time,q1\n0,0\n1,1\n")
    core = Core(make_robot(1, 1))
    _trajectory(core, tmp_path / "t.csv", 1)
    assert core.drives(np.array([1.0 + 5e-10]), 1)[0, 0, 0] == pytest.approx(1.0, abs=1e-15)
    for time in (1.1, -0.1, np.nan):
        with pytest.raises(CoreError, match=r"time is .* s; the trajectory covers 0 to 1 s"):
            core.drives(np.array([time]), 1)


def test_numbers_are_read_as_python_reads_them(tmp_path):
    """Random decimals and doubles with all digits, bit by bit."""
    rng = np.random.default_rng(4)
    texts = [repr(float(v)) for v in rng.normal(size=300) * 10.0 ** rng.integers(-30, 30, 300)]
    texts += [f"{v:.25g}" for v in rng.normal(size=50)]
    texts += ["+1", "-0.0", ".5", "5.", "1e22", "1e23", "9007199254740993", "1e-320", "00012.50e+3"]
    lines = [f"{k},{text}" for k, text in enumerate(texts)]
    (tmp_path / "t.csv").write_text("time,q1\n" + "\n".join(lines))
    core = Core(make_robot(1, 1))
    _trajectory(core, tmp_path / "t.csv", 1)
    found = core.drives(np.arange(len(texts) - 1.0), 1)[0, :, 0]
    np.testing.assert_array_equal(found, [float(text) for text in texts[:-1]])


def test_robots_that_the_core_cannot_hold_are_refused(example):
    joint = example.joints[0]
    with pytest.raises(RobotFileError, match="at most 12 joints for a native FMU, got 13"):
        robot_text(replace(example, joints=(joint,) * 13), "{x}")
    with pytest.raises(CoreError, match="more than 12 joints"):
        Core(
            robot_text(replace(example, joints=(joint,) * 12), "{x}")[:-3]
            + "joint 0 0 0 0 0 1\nend"
        )
    table = tuple((float(k), float(k)) for k in range(-40, 40))
    long = replace(example, joints=(replace(joint, torque_table=table), *example.joints[1:]))
    with pytest.raises(RobotFileError, match="at most 64 points for a native FMU, got 80"):
        robot_text(long, "{x}")


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("elastic-robot 2", "elastic-robot 1", "line 1: found 1; needed is a whole number from 2"),
        ("elastic-robot 2", "robot", "line 1: found 'robot'"),
        ("gravity 0.0", "gravity zero", "line 3: found 'zero'; needed is a finite number"),
        ("\nend", "", "needed is the line 'end'"),
        ("spring", "sprung", "found 'sprung'; needed is joint, spring"),
        ("gravity 0.0 0.0 -9.81", "gravity 0.0 0.0 -9.81 7", "found '7'; needed is the line's end"),
    ],
)
def test_a_broken_description_is_refused_with_its_line(example, old, new, message):
    text = robot_text(example, "{x}")
    assert old in text
    with pytest.raises(CoreError, match=message):
        Core(text.replace(old, new))
