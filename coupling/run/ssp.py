"""Robot and process as one system for a co-simulation master: an SSP archive [SSP1]."""

from __future__ import annotations

import tempfile
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from io import BytesIO
from pathlib import Path
from xml.etree.ElementTree import Element, SubElement, indent, register_namespace, tostring

import elastic_robot
from coupling.case import Case
from coupling.errors import BuildError
from coupling.fmu_export.archive import build_date, write_archive
from coupling.fmu_export.build import BuildOptions, build_fmu
from coupling.fmu_export.process_fmu import build_process_fmu
from coupling.fmu_export.units import BASE_UNITS
from coupling.path.controller import on_cycle
from coupling.path.histories import JointPath
from coupling.robot.inverse_kinematics import InverseKinematics
from coupling.robot.robot_fmu import save_trajectory
from coupling.toolpaths.part import Part
from coupling.toolpaths.task import Task
from elastic_robot.fmi.variables import AXES, POSE

_SSP1 = "http://ssp-standard.org/SSP1/SystemStructure"
SSD, SSC, SSV = f"{_SSP1}Description", f"{_SSP1}Common", f"{_SSP1}ParameterValues"
for _prefix, _namespace in (("ssd", SSD), ("ssc", SSC), ("ssv", SSV)):
    register_namespace(_prefix, _namespace)

ROBOT, PROCESS = "robot", "process"
_TRAJECTORY = "command.npz"
_POSE_UNITS = {f"tcp.{name}": "m" if name in AXES else "1" for name in POSE}
_WRENCH_UNITS = {
    f"{name}.{axis}": unit for name, unit in (("force", "N"), ("moment", "N.m")) for axis in AXES
}


def write_ssp(case: Case, file: Path, platforms: Sequence[str] = ()) -> Path:
    """Write a case's robot, commanded along the desired path, and its process as an SSP archive.

    Args:
        case: The case; its process must be memoryless.
        file: File to write, ending in .ssp.
        platforms: Names of the platforms that the robot's FMU has libraries for; none: this machine.

    Returns:
        The file.

    Raises:
        BuildError: If the process needs the whole path at once, the case is a cell of two robots, or
            the file cannot be written.
        CouplingError: If the path cannot be planned.
    """
    if case.task.support is not None:
        raise BuildError(
            f"{case.name}: expected a case without [support], got a cell of two robots"
        )
    robot, task = case.robots[0], _in_base(case)
    program = robot.placement.path_in_base(robot.programmed(case.task.forming))
    planned = InverseKinematics(robot.description, robot.home).plan(program)
    command = on_cycle(planned, case.controller)
    settings = {
        "trajectory": _TRAJECTORY,
        "torque_curve": robot.torque_curve,
        "mode": case.mode,
    }
    with tempfile.TemporaryDirectory() as folder:
        fmus = (
            build_fmu(
                robot.description,
                Path(folder, "ElasticRobot.fmu"),
                BuildOptions(case.fmu, tuple(platforms)),
                resources={_TRAJECTORY: _table(command)},
            ),
            build_process_fmu(
                case.process_table.process(task), task.desired, Path(folder, "Process.fmu")
            ),
        )
        entries = {f"resources/{fmu.name}": fmu.read_bytes() for fmu in fmus}
    structure = _structure(case, settings, *(fmu.name for fmu in fmus))
    entries["SystemStructure.ssd"] = structure
    write_archive(file, ".ssp", entries, build_date(Path(elastic_robot.__file__).parent))
    return file


def _in_base(case: Case) -> Task:
    """Return the task in the frame of the robot's base, which is that of its FMU."""
    at, task = case.robots[0].placement, case.task
    base_from_world = at.rotation.inv()
    part = Part(base_from_world.apply(task.part.position), base_from_world * task.part.rotation)
    return replace(task, part=part, forming=at.path_in_base(task.forming))


def _table(command: JointPath) -> bytes:
    table = BytesIO()
    save_trajectory(table, command)
    return table.getvalue()


def _structure(case: Case, settings: Mapping[str, str], robot: str, process: str) -> bytes:
    """Return SystemStructure.ssd."""
    root = Element(_ssd("SystemStructureDescription"), {"name": case.name, "version": "1.0"})
    system = SubElement(root, _ssd("System"), {"name": "cell"})
    elements = SubElement(system, _ssd("Elements"))
    component = _component(elements, ROBOT, robot, _WRENCH_UNITS, _POSE_UNITS)
    _bind(component, settings)
    _component(elements, PROCESS, process, _POSE_UNITS, _WRENCH_UNITS)
    connections = SubElement(system, _ssd("Connections"))
    for start, end, names in ((ROBOT, PROCESS, _POSE_UNITS), (PROCESS, ROBOT, _WRENCH_UNITS)):
        for name in names:
            ends = {"startElement": start, "startConnector": name}
            ends |= {"endElement": end, "endConnector": name}
            SubElement(connections, _ssd("Connection"), ends)
    _add_units(root, {*_POSE_UNITS.values(), *_WRENCH_UNITS.values()})
    first, last = case.desired.time[0], case.desired.time[-1]
    limits = {"startTime": repr(float(first)), "stopTime": repr(float(last))}
    SubElement(root, _ssd("DefaultExperiment"), limits)
    indent(root, " ")
    text: bytes = tostring(root, encoding="UTF-8", xml_declaration=True)
    return text


def _component(
    elements: Element, name: str, fmu: str, inputs: Mapping[str, str], outputs: Mapping[str, str]
) -> Element:
    attributes = {"name": name, "type": "application/x-fmu-sharedlibrary"}
    component = SubElement(
        elements, _ssd("Component"), {**attributes, "source": f"resources/{fmu}"}
    )
    connectors = SubElement(component, _ssd("Connectors"))
    for kind, units in (("input", inputs), ("output", outputs)):
        for variable, unit in units.items():
            connector = SubElement(connectors, _ssd("Connector"), {"name": variable, "kind": kind})
            SubElement(connector, f"{{{SSC}}}Real", {"unit": unit})
    return component


def _bind(component: Element, settings: Mapping[str, str]) -> None:
    """Give a component's string parameters their values."""
    bindings = SubElement(component, _ssd("ParameterBindings"))
    values = SubElement(SubElement(bindings, _ssd("ParameterBinding")), _ssd("ParameterValues"))
    parameters = SubElement(
        SubElement(values, f"{{{SSV}}}ParameterSet", {"version": "1.0", "name": "case"}),
        f"{{{SSV}}}Parameters",
    )
    for name, value in settings.items():
        parameter = SubElement(parameters, f"{{{SSV}}}Parameter", {"name": name})
        SubElement(parameter, f"{{{SSV}}}String", {"value": value})


def _add_units(root: Element, names: Iterable[str]) -> None:
    units = SubElement(root, _ssd("Units"))
    for name in sorted(names):
        unit = SubElement(units, f"{{{SSC}}}Unit", {"name": name})
        powers = {base: str(power) for base, power in BASE_UNITS[name].items()}
        SubElement(unit, f"{{{SSC}}}BaseUnit", powers)


def _ssd(name: str) -> str:
    return f"{{{SSD}}}{name}"
