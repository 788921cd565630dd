"""modelDescription.xml of an FMU of FMI 2.0, from blocks of variables."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from xml.etree.ElementTree import Element, SubElement

from coupling.fmu_export import model_description as md
from elastic_robot.fmi.variables import TIME, Block, Variable

_EXCHANGE_FLAGS = (
    "needsExecutionTool",
    "completedIntegratorStepNotNeeded",
    "canBeInstantiatedOnlyOncePerProcess",
    "canNotUseMemoryManagementFunctions",
    "canGetAndSetFMUstate",
    "canSerializeFMUstate",
    "providesDirectionalDerivative",
)
_FLAGS = (
    "needsExecutionTool",
    "canHandleVariableCommunicationStepSize",
    "canInterpolateInputs",
    "canRunAsynchronuously",
    "canBeInstantiatedOnlyOncePerProcess",
    "canNotUseMemoryManagementFunctions",
    "canGetAndSetFMUstate",
    "canSerializeFMUstate",
    "providesDirectionalDerivative",
)


def fmi2_description(
    about: md.ModelInfo,
    blocks: Mapping[str, Block],
    guid: str,
    source_files: Iterable[str] = (),
    statuses: Iterable[str] = md.STATUSES,
) -> bytes:
    """Return modelDescription.xml.

    Value references are the variables' places in the order of the blocks.

    Args:
        about: Description of the FMU.
        blocks: Its variables.
        guid: Ties the description to the binary.
        source_files: C files under sources/ that make up the library, if they are in the FMU.
        statuses: Those of which it has messages.
    """
    root = md.root_element(about, "2.0", "guid", guid)
    exchange = about.exchange is not None
    if exchange:
        indicators = sum(len(b.variables) for b in blocks.values() if b.is_event_indicator)
        root.set("numberOfEventIndicators", str(indicators))
    elements = md.add_model_exchange(root, about, _EXCHANGE_FLAGS)
    elements.append(md.add_co_simulation(root, about, _FLAGS))
    names = list(source_files)
    for element in elements if names else []:
        listed = SubElement(element, "SourceFiles")
        for name in names:
            SubElement(listed, "File", {"name": name})
    md.add_units(root, blocks, more=["s"] if exchange else [])
    md.add_log_categories(root, "fmi2", statuses)
    md.add_experiment(root, about)
    variables = SubElement(root, "ModelVariables")
    numbers = _numbers(blocks)
    reference = 0
    for block in blocks.values():
        of = numbers[block.derivative_of] if block.derivative_of and exchange else None
        for place, variable in enumerate(block.variables):
            derivative = {} if of is None else {"derivative": str(of[place])}
            variables.append(_variable(block, variable, reference, derivative))
            reference += 1
    if exchange:
        time = SubElement(variables, "ScalarVariable", md.time_attributes(reference))
        SubElement(time, "Real", {"unit": "s"})
    _add_structure(root, blocks, exchange)
    return md.xml_text(root)


def _numbers(blocks: Mapping[str, Block]) -> dict[str, range]:
    """Numbers of the variables by block, from 1; behind them that of time."""
    numbers: dict[str, range] = {}
    first = 1
    for name, block in blocks.items():
        numbers[name] = range(first, first + len(block.variables))
        first += len(block.variables)
    return {**numbers, TIME: range(first, first + 1)}


def _variable(
    block: Block, variable: Variable, reference: int, derivative: Mapping[str, str]
) -> Element:
    attributes = md.variable_attributes(block, variable.name, variable.text, reference)
    element = Element("ScalarVariable", attributes)
    if not variable.unit:
        SubElement(element, "String", {"start": str(variable.start)})
        return element
    start = {} if variable.start is None else {"start": repr(variable.start)}
    SubElement(element, "Real", {**md.range_attributes(variable), **derivative, **start})
    return element


def _add_structure(root: Element, blocks: Mapping[str, Block], exchange: bool) -> None:
    numbers = _numbers(blocks)
    structure = SubElement(root, "ModelStructure")
    _add_unknowns(structure, "Outputs", blocks, md.output_names(blocks), exchange)
    if exchange:
        _add_unknowns(structure, "Derivatives", blocks, md.derivative_names(blocks), True)
    names = md.initial_names(blocks, exchange)
    initial = [(name, md.starting_names(blocks[name], exchange)) for name in names]
    unknowns = SubElement(structure, "InitialUnknowns")
    for name, dependencies in initial:
        depends = md.sorted_text(k for other in dependencies for k in numbers[other])
        for k in numbers[name]:
            SubElement(unknowns, "Unknown", {"index": str(k), "dependencies": depends})


def _add_unknowns(
    structure: Element, element: str, blocks: Mapping[str, Block], names: list[str], exchange: bool
) -> None:
    numbers = _numbers(blocks)
    if not any(numbers[name] for name in names):
        return
    unknowns = SubElement(structure, element)
    # FMIKit for Simulink believes only dependencies that have a kind: others are all inputs to it.
    kinds = element == "Outputs"
    for name in names:
        dependencies = md.known_names(blocks[name], exchange)
        in_block = [other for other in dependencies if other in blocks[name].elementwise]
        all_of = [k for other in dependencies if other not in in_block for k in numbers[other]]
        for place, k in enumerate(numbers[name]):
            follows = [*all_of, *(numbers[other][place] for other in in_block)]
            attributes = {"index": str(k), "dependencies": md.sorted_text(follows)}
            if kinds:
                attributes["dependenciesKind"] = " ".join(["dependent"] * len(follows))
            SubElement(unknowns, "Unknown", attributes)
