"""SystemStructure.ssd: components, connections and the experiment to begin with [SSP1]."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from xml.etree.ElementTree import Element, SubElement, indent, register_namespace, tostring

import elastic_robot
from coupling.fmu_export.model_description import BASE_UNITS
from elastic_robot.fmi.variables import AXES, POSE, SYMMETRIC

_SSP1 = "http://ssp-standard.org/SSP1/SystemStructure"
SSD, SSC = f"{_SSP1}Description", f"{_SSP1}Common"
# Of the Open Simulation Platform, whose libcosim takes a step from there.
OSP = "http://opensimulationplatform.com/SSP/OSPAnnotations"
for _prefix, _namespace in (("ssd", SSD), ("ssc", SSC), ("osp", OSP)):
    register_namespace(_prefix, _namespace)

ROBOT, PROCESS = "robot", "process"
POSE_UNITS = {f"tcp.{name}": "m" if name in AXES else "1" for name in POSE}
WRENCH_UNITS = {
    f"{name}.{axis}": unit for name, unit in (("force", "N"), ("moment", "N.m")) for axis in AXES
}
SPRING_UNITS = {
    **{f"anchor.{axis}": "m" for axis in AXES},
    **{f"anchor.v{axis}": "m/s" for axis in AXES},
    **{f"anchor.k{entry}": "N/m" for entry in SYMMETRIC},
}


@dataclass(frozen=True)
class SystemStructure:
    """Description of a system of robot and process for a master.

    Attributes:
        name: Name of the system's description.
        robot, process: File names of the FMUs in resources/.
        outputs: Units of what the process gives to the robot, by variable.
        start, stop: Times of the experiment [s].
        step: Its communication step [s].
    """

    name: str
    robot: str
    process: str
    outputs: Mapping[str, str]
    start: float
    stop: float
    step: float

    def text(self) -> bytes:
        """Return the file."""
        tool = f"elastic-robot-fmu {elastic_robot.__version__}"
        about = {"name": self.name, "version": "1.0", "generationTool": tool}
        root = Element(_ssd("SystemStructureDescription"), about)
        system = SubElement(root, _ssd("System"), {"name": "cell"})
        elements = SubElement(system, _ssd("Elements"))
        _component(elements, ROBOT, self.robot, self.outputs, POSE_UNITS)
        _component(elements, PROCESS, self.process, POSE_UNITS, self.outputs)
        connections = SubElement(system, _ssd("Connections"))
        for start, end, names in ((ROBOT, PROCESS, POSE_UNITS), (PROCESS, ROBOT, self.outputs)):
            for name in names:
                ends = {"startElement": start, "startConnector": name}
                ends |= {"endElement": end, "endConnector": name}
                SubElement(connections, _ssd("Connection"), ends)
        _add_units(root, {*POSE_UNITS.values(), *self.outputs.values()})
        self._add_experiment(root)
        indent(root, " ")
        return tostring(root, encoding="UTF-8", xml_declaration=True)

    def _add_experiment(self, root: Element) -> None:
        """Add start, stop and step.

        SSP 1.0 has no attribute for the step, and annotations for what it has no attribute for.
        """
        limits = {"startTime": repr(self.start), "stopTime": repr(self.stop)}
        experiment = SubElement(root, _ssd("DefaultExperiment"), limits)
        annotations = SubElement(experiment, _ssd("Annotations"))
        of_platform = {"type": "com.opensimulationplatform"}
        annotation = SubElement(annotations, f"{{{SSC}}}Annotation", of_platform)
        algorithm = SubElement(annotation, f"{{{OSP}}}Algorithm")
        SubElement(algorithm, f"{{{OSP}}}FixedStepAlgorithm", {"baseStepSize": repr(self.step)})


def _component(
    elements: Element, name: str, fmu: str, inputs: Mapping[str, str], outputs: Mapping[str, str]
) -> None:
    attributes = {"name": name, "type": "application/x-fmu-sharedlibrary"}
    component = SubElement(
        elements, _ssd("Component"), {**attributes, "source": f"resources/{fmu}"}
    )
    connectors = SubElement(component, _ssd("Connectors"))
    for kind, units in (("input", inputs), ("output", outputs)):
        for variable, unit in units.items():
            connector = SubElement(connectors, _ssd("Connector"), {"name": variable, "kind": kind})
            SubElement(connector, f"{{{SSC}}}Real", {"unit": unit})


def _add_units(root: Element, names: Iterable[str]) -> None:
    units = SubElement(root, _ssd("Units"))
    for name in sorted(names):
        unit = SubElement(units, f"{{{SSC}}}Unit", {"name": name})
        powers = {base: str(power) for base, power in BASE_UNITS[name].items()}
        SubElement(unit, f"{{{SSC}}}BaseUnit", powers)


def _ssd(name: str) -> str:
    return f"{{{SSD}}}{name}"
