"""modelDescription.xml: what the descriptions of FMI 2.0 and 3.0 share."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from datetime import datetime
from xml.etree.ElementTree import Element, SubElement, indent, tostring

import elastic_robot
from elastic_robot.description import Robot
from elastic_robot.fmi.interface import STEP_SIZE
from elastic_robot.fmi.tolerance import RELATIVE
from elastic_robot.fmi.variables import TIME, Block, Variable

# Statuses of which there are messages; a Python that is not found is fatal beside them.
STATUSES = ("Warning", "Discard", "Error")
# Exponents of the base units (FMI 2.0.4, 2.2.2); all variables are in coherent SI units, factor 1.
BASE_UNITS: dict[str, dict[str, int]] = {
    "1": {},
    "s": {"s": 1},
    "m": {"m": 1},
    "s/m": {"m": -1, "s": 1},
    "m/s": {"m": 1, "s": -1},
    "m/s2": {"m": 1, "s": -2},
    "m/N": {"kg": -1, "s": 2},
    "rad": {"rad": 1},
    "rad/s": {"rad": 1, "s": -1},
    "rad/s2": {"rad": 1, "s": -2},
    "N": {"kg": 1, "m": 1, "s": -2},
    "N/s": {"kg": 1, "m": 1, "s": -3},
    "N/m": {"kg": 1, "s": -2},
    "N.m": {"kg": 1, "m": 2, "s": -2},
    "N.m/s": {"kg": 1, "m": 2, "s": -3},
    "N.m/rad": {"kg": 1, "m": 2, "s": -2, "rad": -1},
    "N.m.s/rad": {"kg": 1, "m": 2, "s": -1, "rad": -1},
}


@dataclass(frozen=True)
class ModelInfo:
    """What an FMU tells of itself.

    Attributes:
        model_name: Name of the model; also of its library.
        description: One line.
        made_with: Tool beside this one that it was made with.
        date: Date of the build, UTC.
        capabilities: Flags of `CoSimulation` that are true, as the FMI version names them.
        stop_time: Stop time to begin with [s].
        exchange: Flags of `ModelExchange` that are true; None where there is none.
    """

    model_name: str
    description: str
    made_with: str
    date: datetime
    capabilities: tuple[str, ...]
    stop_time: float = 1.0
    exchange: tuple[str, ...] | None = None


def robot_line(robot: Robot) -> str:
    """Return a robot's FMU in one line."""
    return (
        f"Industrial robot {robot.name} with elastic joints, tilts and backlash:"
        " tool forces in, TCP pose out"
    )


def root_element(about: ModelInfo, fmi_version: str, token_name: str, token: str) -> Element:
    """Return the root.

    Args:
        about: Description of the FMU.
        token_name: Name of the attribute that ties the description to the binary.
        token: Its value.
    """
    version = elastic_robot.__version__
    return Element(
        "fmiModelDescription",
        {
            "fmiVersion": fmi_version,
            "modelName": about.model_name,
            token_name: token,
            "description": about.description,
            "author": "The elastic-robot-fmu authors",
            "version": version,
            "copyright": "Copyright (c) 2026 The elastic-robot-fmu authors",
            "license": "MIT, see documentation/licenses",
            "generationTool": f"elastic-robot-fmu {version}, {about.made_with}",
            "generationDateAndTime": f"{about.date:%Y-%m-%dT%H:%M:%SZ}",
            "variableNamingConvention": "structured",
        },
    )


def add_co_simulation(root: Element, about: ModelInfo, flags: Iterable[str]) -> Element:
    """Add the element `CoSimulation` and return it; flags are all that this FMI version knows.

    Every flag is stated, since masters differ in the defaults that they assume.
    """
    attributes = _flags(about.capabilities, flags)
    attributes["maxOutputDerivativeOrder"] = "0"
    return SubElement(root, "CoSimulation", {"modelIdentifier": about.model_name, **attributes})


def add_model_exchange(root: Element, about: ModelInfo, flags: Iterable[str]) -> list[Element]:
    """Add the element `ModelExchange`, if there is one, and return what was added."""
    if about.exchange is None:
        return []
    attributes = _flags(about.exchange, flags)
    attributes_of_kind = {"modelIdentifier": about.model_name, **attributes}
    return [SubElement(root, "ModelExchange", attributes_of_kind)]


def _flags(true: Iterable[str], flags: Iterable[str]) -> dict[str, str]:
    names, true_flags = list(flags), set(true)
    assert true_flags <= set(names), true_flags - set(names)
    return {name: _boolean(name in true_flags) for name in names}


def add_units(root: Element, blocks: Mapping[str, Block], more: Iterable[str] = ()) -> None:
    """Add the units that the variables have, and more."""
    used = {v.unit for block in blocks.values() for v in block.variables if v.unit} | set(more)
    definitions = SubElement(root, "UnitDefinitions")
    for unit in sorted(used):
        element = SubElement(definitions, "Unit", {"name": unit})
        SubElement(element, "BaseUnit", {k: str(n) for k, n in BASE_UNITS[unit].items()})


def add_log_categories(root: Element, status_prefix: str, statuses: Iterable[str]) -> None:
    """Add the categories of the standard that are used; its names of a status begin with a prefix."""
    categories = SubElement(root, "LogCategories")
    events = {"name": "logEvents", "description": "Beginning and end of a simulation"}
    SubElement(categories, "Category", events)
    for status in statuses:
        description = f"Messages with status {status_prefix}{status}"
        names = {"name": f"logStatus{status}", "description": description}
        SubElement(categories, "Category", names)
    SubElement(categories, "Category", {"name": "logAll", "description": "All messages"})


def add_experiment(root: Element, about: ModelInfo) -> None:
    """Add the experiment to begin with."""
    SubElement(
        root,
        "DefaultExperiment",
        {
            "startTime": "0",
            "stopTime": repr(about.stop_time),
            "tolerance": repr(RELATIVE),
            "stepSize": repr(STEP_SIZE),
        },
    )


def variable_attributes(block: Block, name: str, text: str, reference: int) -> dict[str, str]:
    """Return the attributes that variables of every type have."""
    attributes = {
        "name": name,
        "valueReference": str(reference),
        "description": text,
        "causality": block.causality,
        "variability": block.variability,
    }
    if block.causality != "input":  # inputs have no initial (FMI 2.0.4, table on page 49)
        attributes["initial"] = "exact" if block.causality == "parameter" else "calculated"
    return attributes


def time_attributes(reference: int) -> dict[str, str]:
    """Return the attributes of the independent variable."""
    return {
        "name": "time",
        "valueReference": str(reference),
        "description": "Time; in co-simulation the end of the last step",
        "causality": "independent",
        "variability": "continuous",
    }


def range_attributes(variable: Variable) -> dict[str, str]:
    """Return the attributes of a real that hold for a whole array of its kind."""
    numbers = {
        "min": variable.minimum,
        "max": variable.maximum,
        "nominal": variable.nominal,
    }
    limits = {name: repr(value) for name, value in numbers.items() if value is not None}
    return {"unit": variable.unit, **limits}


def output_names(blocks: Mapping[str, Block]) -> list[str]:
    """Return the names of the blocks of outputs."""
    return [name for name, block in blocks.items() if block.causality == "output"]


def derivative_names(blocks: Mapping[str, Block]) -> list[str]:
    """Return the names of the blocks of states' derivatives, in the order of the states."""
    return [name for name, block in blocks.items() if block.derivative_of]


def initial_names(blocks: Mapping[str, Block], exchange: bool) -> list[str]:
    """Return the names of the blocks whose initial values are computed: outputs, states' derivatives."""
    return [*output_names(blocks), *(derivative_names(blocks) if exchange else [])]


def at_points(blocks: Mapping[str, Block]) -> dict[str, Block]:
    """Return blocks as they are at a communication point of co-simulation, where none follows an input.

    Values are computed in a step and held at its end, so an input that is set there changes none of
    them; what they follow in model exchange stays.  Importers take the list for algebraic loops.
    """
    return {name: replace(block, follows=()) for name, block in blocks.items()}


def starting_names(block: Block, exchange: bool) -> list[str]:
    """Return the names of all blocks that an initial value depends on; time is there with exchange."""
    return [name for name in block.starts_from if exchange or name != TIME]


def known_names(block: Block, exchange: bool) -> list[str]:
    """Return the names of all blocks that a block depends on, in co-simulation or model exchange."""
    of_exchange = [name for name in block.exchanged if exchange and name not in block.follows]
    return [*block.follows, *of_exchange]


def sorted_text(numbers: Iterable[int]) -> str:
    """Return numbers in their order with blanks between them."""
    return " ".join(str(k) for k in sorted(numbers))


def xml_text(root: Element) -> bytes:
    """Return the file."""
    indent(root, " ")
    text: bytes = tostring(root, encoding="UTF-8", xml_declaration=True)
    return text + b"\n"


def _boolean(value: bool) -> str:
    return "true" if value else "false"
