"""The FMU as a host sees it: contract, initialisation, steps, errors.  It runs in its own process."""

from dataclasses import replace

import fmpy
import numpy as np
import pytest
from places import HOSTS, REFERENCE

from build_fmu import main
from coupling.errors import BuildError
from coupling.fmu_export.build import BuildOptions, build_fmu
from coupling.native.compiler import host_platform
from elastic_robot.errors import ParameterError
from elastic_robot.fingerprint import fingerprint

POSE = [f"tcp.{c}" for c in ("x", "y", "z", "qx", "qy", "qz", "qw")]
POSTURE = {f"q_cmd[{i + 1}]": q for i, q in enumerate([0.0, -0.3, 0.5, 0.0, 0.6, 0.0])}


def _expected_names() -> dict[str, list[str]]:
    six = range(1, 7)
    elastic = [
        *["joint[1]", "joint[1].tilt[1]", "joint[1].tilt[2]"],
        *["joint[2]", "joint[2].tilt[1]", "joint[2].tilt[2]"],
        *["joint[3]", "joint[3].tilt[1]", "joint[3].tilt[2]", "joint[4]", "joint[5]"],
    ]
    return {
        "input": [
            *["force.x", "force.y", "force.z", "moment.x", "moment.y", "moment.z"],
            *[f"{name}[{i}]" for name in ("q_cmd", "qd_cmd", "qdd_cmd") for i in six],
            *[f"anchor.{c}" for c in ("x", "y", "z", "vx", "vy", "vz")],
            *[f"anchor.k{c}" for c in ("xx", "xy", "xz", "yy", "yz", "zz")],
            *[f"{name}_rate.{c}" for name in ("force", "moment") for c in "xyz"],
            *["contact.stiffness", "contact.dissipation", "contact.radius", "contact.friction"],
            *["contact.slip_speed", "contact.nx", "contact.ny", "contact.nz"],
        ],
        "output": [
            *POSE,
            *["tcp.vx", "tcp.vy", "tcp.vz", "tcp.wx", "tcp.wy", "tcp.wz"],
            *[name.replace("tcp", "rigid") for name in POSE],
            *["deviation.x", "deviation.y", "deviation.z"],
            *["deviation.rx", "deviation.ry", "deviation.rz"],
            *[f"compliance.{c}" for c in ("xx", "xy", "xz", "yy", "yz", "zz")],
            *[f"{name}[{k}]" for name in ("deflection", "deflection_rate") for k in range(1, 12)],
            *["contact.fx", "contact.fy", "contact.fz"],
            *[f"{name}[{i}]" for name in ("gear_torque", "motor_torque") for i in range(1, 6)],
            *[f"{name}[{i}]" for name in ("motor_angle", "motor_rate") for i in range(1, 7)],
        ],
        "local": [
            *[f"der({s}[{k}])" for s in ("deflection", "deflection_rate") for k in range(1, 12)],
            *[f"joint[{i}].bend.{side}" for i in range(1, 6) for side in ("below", "above")],
            "contact.gap",
        ],
        "parameter": [
            *["gravity.x", "gravity.y", "gravity.z"],
            *[f"{name}.stiffness" for name in elastic],
            *[f"{name}.damping" for name in elastic],
            *[f"joint[{i}].backlash" for i in range(1, 6)],
            "tcp_tolerance",
            *["trajectory", "torque_curve", "mode", "initial_state", "drive"],
        ],
    }


def test_every_variable_of_the_contract_is_there(example_fmu, example):
    description = fmpy.read_model_description(str(example_fmu))
    assert description.modelName == "ElasticRobot"
    found = {}
    for variable in description.modelVariables:
        found.setdefault(variable.causality, []).append(variable.name)
    # Of the kind that has model exchange.
    assert found.pop("independent", ["time"]) == ["time"]
    assert found == _expected_names()
    kinds = {v.name: (v.variability, v.start) for v in description.modelVariables}
    assert kinds["mode"] == ("fixed", "dynamic")
    assert kinds["torque_curve"] == ("fixed", "backlash")
    assert kinds["initial_state"] == ("fixed", "equilibrium")
    assert kinds["joint[2].stiffness"][0] == "tunable"
    assert float(kinds["joint[2].stiffness"][1]) == pytest.approx(
        example.joints[1].stiffness, rel=1e-15
    )
    assert float(kinds["gravity.z"][1]) == -9.81
    assert (kinds["tcp_tolerance"][0], float(kinds["tcp_tolerance"][1])) == ("fixed", 0.0)


def test_equilibrium_is_computed_from_what_is_set_before_initialisation_ends(example_fmu, run_fmu):
    load = {"force.z": -1000.0}
    jobs = [
        {"start": POSTURE | load, "time": [0.0, 0.01], "inputs": {"force.z": [-1000.0] * 2}},
        {"start": POSTURE, "time": [0.0, 0.01], "settings": {"initial_state": "undeflected"}},
    ]
    for job in jobs:
        job["outputs"] = ["deviation.x", "deviation.y", "deviation.z", "tcp.vz", "deflection[2]"]
    loaded, undeflected = (answer["values"] for answer in run_fmu(example_fmu, *jobs))
    # At rest under gravity and force it stays; undeflected it starts to fall.
    np.testing.assert_allclose(loaded[1], loaded[0], rtol=0, atol=1e-11)
    assert np.all(undeflected[0] == 0.0)
    assert undeflected[1, 3] < -1e-3


def test_communication_steps_do_not_change_the_trajectory(example_fmu, run_fmu):
    rng = np.random.default_rng(5)
    times = [
        np.array([2.0, 3.0]),
        2.0 + np.arange(0.0, 1.0001, 0.004),
        np.concatenate([[2.0], 2.0 + np.sort(rng.uniform(0.0, 1.0, 49)), [3.0]]),
    ]
    jobs = [
        {
            "settings": {"trajectory": str(REFERENCE / "iso_path_joints.npz")},
            "time": time,
            "outputs": POSE,
        }
        for time in times
    ]
    ends = [answer["values"][-1] for answer in run_fmu(example_fmu, *jobs)]
    for end in ends[1:]:
        np.testing.assert_allclose(end, ends[0], rtol=0, atol=1e-6)


def test_trajectory_is_sought_in_the_fmu_and_then_where_the_master_runs(example, run_fmu, tmp_path):
    """Joint 1 stands at 0.3 rad in the packed file, at 0.1 rad in those beside the master."""
    table = "time,q1,q2,q3,q4,q5,q6\n0,{0},0,0,0,0,0\n1,{0},0,0,0,0,0\n"
    fmu = build_fmu(
        example, tmp_path / "R.fmu", resources={"motion.csv": table.format(0.3).encode()}
    )
    for name, angle in (("motion.csv", 0.3), ("other.csv", 0.1)):
        (tmp_path / name).write_text(table.format(0.1))
        job = {
            "settings": {"trajectory": name, "mode": "quasistatic"},
            "time": [0.0, 0.1],
            "outputs": ["rigid.x", "rigid.y"],
        }
        (answer,) = run_fmu(fmu, job)
        x, y = answer["values"][-1]
        assert np.arctan2(y, x) == pytest.approx(angle, abs=1e-12)


def test_build_refuses_a_wrong_name_and_an_unwritable_place(example, tmp_path):
    with pytest.raises(BuildError, match=r"ends in \.fmu"):
        build_fmu(example, tmp_path / "robot.zip")
    blocked = tmp_path / "file"
    blocked.write_text("")
    with pytest.raises(BuildError, match=r"cannot be (written|made)"):
        build_fmu(example, blocked / "robot.fmu")


def test_command_builds_the_shipped_robot(tmp_path, capsys):
    file = tmp_path / "deep" / "R.fmu"
    assert main(["-o", str(file), "--platforms", host_platform().name]) == 0
    assert file.is_file()
    assert [f.name for f in file.parent.iterdir()] == ["R.fmu"]
    assert str(file) in capsys.readouterr().out


def test_fingerprint_tells_robots_apart(example, tmp_path):
    other = replace(example, gravity=(0.0, 0.0, -1.6))
    prints = set()
    for k, robot in enumerate([example, example, other]):
        folder = fmpy.extract(
            str(build_fmu(robot, tmp_path / f"{k}.fmu")), unzipdir=tmp_path / str(k)
        )
        prints.add(fingerprint(tmp_path / str(k) / "resources"))
        del folder
    assert len(prints) == 2


@pytest.mark.parametrize("kind", ["native", "python"])
def test_start_values_are_said_and_taken_in_both_kinds_of_fmu(kind, example, tmp_path, forked):
    """What the description says is what an instance has, before and after a reset of its values."""
    strings = {"mode": "quasistatic", "trajectory": "motion.npz", "torque_curve": "linear"}
    fmu = build_fmu(example, tmp_path / "R.fmu", BuildOptions(kind, strings=strings))
    variables = fmpy.read_model_description(str(fmu)).modelVariables
    assert {v.name: v.start for v in variables if v.name in strings} == strings
    script = tmp_path / "asked.py"
    script.write_text(f"""
import sys
sys.path.append({str(HOSTS)!r})
from fmu import Fmu
fmu = Fmu(sys.argv[1])
slave = fmu.instance().slave
names = {list(strings)!r}
for _ in range(2):
    slave.setupExperiment(startTime=0.0)
    slave.enterInitializationMode()
    print([v.decode() for v in slave.getString([fmu.references[name] for name in names])])
    slave.reset()
""")
    done = forked(script, fmu)
    assert done.stdout.splitlines() == [str(list(strings.values()))] * 2, done.stderr


@pytest.mark.parametrize("value", ["", "two words", "a" * 64, "line\nbreak"])
def test_a_start_value_that_is_no_word_is_refused(value):
    with pytest.raises(BuildError, match="start value of trajectory: expected 1 to 63 bytes"):
        BuildOptions(strings={"trajectory": value})


def test_a_start_value_of_no_string_or_out_of_its_choices_is_refused(example, tmp_path):
    for strings, sentence in (
        ({"speed": "fast"}, "expected a string variable, got 'speed'"),
        ({"mode": "fast"}, "mode: expected one of dynamic, quasistatic, got 'fast'"),
    ):
        with pytest.raises(ParameterError, match=sentence):
            build_fmu(example, tmp_path / "R.fmu", BuildOptions(strings=strings))
