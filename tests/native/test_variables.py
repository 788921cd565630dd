"""The native FMU's variables, sentences, resources, and what is declared of the variables."""

import os

import fmpy
import numpy as np
import pytest
from native_core import folder_from_uri
from native_fmu import TCP, NativeFmu
from random_robots import driven, make_robot, with_gear_parts

from coupling.fmu_export.build import BuildOptions, build_fmu
from coupling.fmu_export.exchange_blocks import all_blocks

TUNABLE = {"gravity.z", "joint[2].stiffness", "joint[1].tilt[2].damping", "joint[3].backlash"}


def test_the_fmu_in_python_has_the_same_inputs_outputs_and_parameters(example, tmp_path):
    kinds = [
        fmpy.read_model_description(
            str(build_fmu(example, tmp_path / f"{kind}.fmu", BuildOptions(kind)))
        )
        for kind in ("python", "native")
    ]
    one, two = (
        [
            (v.name, v.causality, v.variability, v.unit, v.start)
            for v in d.modelVariables
            # Of model exchange.
            if v.causality not in ("local", "independent")
        ]
        for d in kinds
    )
    assert one == two
    assert len(one) == len(kinds[0].modelVariables)


def test_names_and_units_in_messages_are_those_of_the_table(tmp_path):
    """Every real in turn is set to NaN; the sentence names it as the table does, with its unit."""
    robot = make_robot(3, 5)
    fmu = NativeFmu(build_fmu(robot, tmp_path / "R.fmu", BuildOptions("native")), tmp_path / "fmu")
    slave, said = fmu.slave(), []
    table = all_blocks(robot)
    strings = table.pop("strings")
    assert [v.name for v in strings.variables] == [
        "trajectory",
        "torque_curve",
        "mode",
        "initial_state",
        "drive",
    ]
    reals = [(b, v) for b in table.values() for v in b.variables]
    read, write = os.pipe()
    stderr = os.dup(2)
    os.dup2(write, 2)
    try:
        for reference in range(len(reals)):
            with pytest.raises(fmpy.fmi1.FMICallException):
                slave.setReal([reference], [float("nan")])
            said.append(os.read(read, 10000).decode())
    finally:
        os.dup2(stderr, 2)
    for (block, variable), text in zip(reals, said, strict=True):
        if block.causality in ("output", "local"):
            kind = "an output" if block.causality == "output" else "computed"
            assert f"robot: {variable.name} is {kind} and cannot be set" in text
        else:
            sentence = f"robot: {variable.name}: expected a finite number, got nan {variable.unit}"
            assert sentence in text
    slave.freeInstance()


def test_a_locale_with_decimal_commas_changes_nothing(native, tmp_path):
    """The same CSV read under de_DE.UTF-8 if the machine has it, else any with a comma."""
    import locale

    line = "{0},0,-0.3125,0.5,0,{1},0\n"
    file = tmp_path / "motion.csv"
    file.write_text(
        "time,q1,q2,q3,q4,q5,q6\n"
        + line.format("0.0", "0.6789123456789012345")
        + line.format("1.5", "0.7")
    )
    slave = native.started(trajectory=str(file))
    expected = native.get(slave, *TCP)
    names = ("de_DE.UTF-8", "de_DE.utf8", "fr_FR.UTF-8", "ru_RU.UTF-8")
    for name in names:
        try:
            locale.setlocale(locale.LC_NUMERIC, name)
            break
        except locale.Error:
            continue
    else:
        pytest.skip("needs a locale with a decimal comma")
    try:
        slave = native.started(trajectory=str(file))
        assert native.get(slave, *TCP) == expected
    finally:
        locale.setlocale(locale.LC_NUMERIC, "C")


def test_paths_of_any_characters_are_taken(example, tmp_path):
    """A folder with blanks, umlauts, per cent and plus; the URI encodes it or not."""
    folder = tmp_path / "a b äö 100%41 + c"
    fmu = NativeFmu(build_fmu(example, tmp_path / "R.fmu", BuildOptions("native")), folder)
    slave = fmu.started()
    assert np.isfinite(fmu.get(slave, "tcp.x")[0])


def test_a_parameter_that_is_set_to_its_value_changes_nothing(native):
    """Bit for bit: the integration does not start anew."""
    one, twin = native.started(), native.started()
    names = [v.name for v in native.description.modelVariables if v.variability == "tunable"]
    values = dict(zip(names, native.get(one, *names), strict=True))
    for k in range(20):
        for slave in (one, twin):
            native.set(slave, {"force.z": -500.0 * (k % 7 < 3)})
        native.set(one, values)
        for slave in (one, twin):
            slave.doStep(0.004 * k, 0.004)
        assert one.getReal(native.outputs) == twin.getReal(native.outputs)


# By a URI: the folder on Windows, and elsewhere.
URIS = {
    "file:///C:/a/b": ("C:/a/b", "/C:/a/b"),
    "file:/C:/a": ("C:/a", "/C:/a"),
    "file:C:/a": ("C:/a", "C:/a"),
    "file://C:/a/b": ("C:/a/b", "/a/b"),
    "file://C:\\a\\b": ("C:\\a\\b", ""),
    "file:///C%3A/a%20b": ("C:/a b", "/C:/a b"),
    "file://C%3a/a": ("C:/a", "/a"),
    "file://server/share/a": ("//server/share/a", "/share/a"),
    "file:////server/share/a": ("//server/share/a", "//server/share/a"),
    "file://localhost/C:/a": ("C:/a", "/C:/a"),
    "file:///home/%C3%A4%": ("/home/ä%", "/home/ä%"),
    "file://host/a": ("//host/a", "/a"),
    "file:": ("", ""),
    "file://": ("", ""),
    "file:/%": ("/%", "/%"),
    "http://C:/a": (None, None),
    "": (None, None),
}


@pytest.mark.parametrize("uri", URIS)
def test_a_uri_names_a_folder_as_each_system_writes_it(uri):
    """RFC 8089, its appendix on drives and shares, and what masters on Windows write."""
    assert (folder_from_uri(uri, True), folder_from_uri(uri, False)) == URIS[uri]


def test_resources_are_found_in_a_folder_of_any_length(example, tmp_path):
    """More than a thousand letters: a trajectory that is packed into the FMU is read there."""
    deep = tmp_path.joinpath(*["x" * 200] * 6)
    time = np.linspace(0.0, 1.0, 3)
    np.savetxt(
        tmp_path / "path.csv",
        np.column_stack([time, *[0.1 * time] * 6]),
        delimiter=",",
        header="time,q1,q2,q3,q4,q5,q6",
        comments="",
    )
    packed = {"path.csv": (tmp_path / "path.csv").read_bytes()}
    file = build_fmu(example, tmp_path / "R.fmu", BuildOptions("native"), packed)
    deep.mkdir(parents=True)
    fmu = NativeFmu(file, deep)
    assert len(os.fspath(deep)) > 1200
    slave = fmu.started(trajectory="path.csv")
    slave.doStep(0.0, 0.01)
    assert np.isfinite(fmu.get(slave, "tcp.x")[0])


@pytest.mark.parametrize("use", ["cs", "me"])
@pytest.mark.parametrize("fmi", ["2", "3"])
def test_every_declared_dependency_is_answered_with_the_slope_of_the_values(
    example, tmp_path, run_host, fmi, use
):
    """In initialisation mode, at communication points and in event mode, on all torque curves, along
    commands and a trajectory; and what is not declared has none, where that is asked for over a step."""
    options = BuildOptions("native", fmi=fmi, dependencies="step")
    file = build_fmu(example, tmp_path / "R.fmu", options)
    run_host("declared", file, use)


@pytest.mark.parametrize(
    ("fmi", "use", "drive"),
    [("2", "cs", "servo"), ("3", "cs", "servo"), ("2", "me", "servo"), ("3", "me", "torque")],
)
def test_so_it_is_with_motors(example, tmp_path, run_host, fmi, use, drive):
    """The same of a robot whose motors, friction and hysteresis move, behind errors and balancers."""
    options = BuildOptions("native", fmi=fmi, dependencies="step")
    robot = driven(with_gear_parts(example, 1), np.random.default_rng(5))
    run_host("declared", build_fmu(robot, tmp_path / "R.fmu", options), use, drive)


@pytest.mark.parametrize(("fmi", "use"), [("2", "me"), ("3", "me"), ("2", "cs")])
def test_so_it_is_with_kinematic_errors_and_balancers(example, tmp_path, run_host, fmi, use):
    """Without motors: what drives feel of a gear's torque follows where they are."""
    robot = with_gear_parts(example, 1)
    options = BuildOptions("native", fmi=fmi, dependencies="step")
    run_host("declared", build_fmu(robot, tmp_path / "R.fmu", options), use)


@pytest.mark.parametrize("arrays", [False, True])
def test_parameters_and_the_time_of_the_start_are_declared(example, tmp_path, arrays):
    """FMI 3.0.2, 2.4.8: "parameters (variables with causality = parameter)" are knowns of outputs and
    state derivatives, in FMI 2 of initial unknowns alone; so is "the independent variable" of
    these."""
    options = [BuildOptions("native", fmi="3", arrays=arrays), BuildOptions("native")]
    three, two = (
        fmpy.read_model_description(str(build_fmu(example, tmp_path / f"{k}.fmu", option)))
        for k, option in enumerate(options)
    )
    tcp, gravity = ("tcp.position", "gravity") if arrays else ("tcp.x", "gravity.z")
    tunable = TUNABLE - {"gravity.z"} | {gravity}
    for listed, wanted in (
        (three.outputs, tunable),
        (three.derivatives, tunable),
        (three.initialUnknowns, tunable - {"joint[1].tilt[2].damping"} | {"time"}),
    ):
        declared = {u.variable.name: {d.name for d in u.dependencies} for u in listed}
        accelerations = [name for name in declared if name.startswith("der(deflection_rate")]
        for name in [tcp] if tcp in declared else accelerations:
            assert wanted <= declared[name], name
    assert not any(d.causality == "parameter" for u in two.outputs for d in u.dependencies)
    for unknown in two.initialUnknowns:
        if unknown.variable.name.startswith(("tcp", "rigid")):
            assert "time" in {d.name for d in unknown.dependencies}
