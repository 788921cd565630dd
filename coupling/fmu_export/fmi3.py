"""modelDescription.xml of an FMU of FMI 3.0, from blocks of variables."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from xml.etree.ElementTree import Element, SubElement

from coupling.fmu_export import model_description as md
from coupling.fmu_export.grouping import Groups, VariableGroup
from elastic_robot.fmi.variables import TIME, Block, Variable

_COMMON_FLAGS = (
    "needsExecutionTool",
    "canBeInstantiatedOnlyOncePerProcess",
    "canGetAndSetFMUState",
    "canSerializeFMUState",
    "providesDirectionalDerivatives",
    "providesAdjointDerivatives",
    "providesPerElementDependencies",
)
_EXCHANGE_FLAGS = (
    *_COMMON_FLAGS,
    "needsCompletedIntegratorStep",
    "providesEvaluateDiscreteStates",
)
_FLAGS = (
    *_COMMON_FLAGS,
    "canHandleVariableCommunicationStepSize",
    "providesIntermediateUpdate",
    "mightReturnEarlyFromDoStep",
    "canReturnEarlyAfterIntermediateUpdate",
    "hasEventMode",
    "providesEvaluateDiscreteStates",
)


def fmi3_description(
    about: md.ModelInfo, blocks: Mapping[str, Block], groups: Groups, token: str
) -> bytes:
    """Return modelDescription.xml.

    Args:
        about: Description of the FMU.
        blocks: Its variables, element by element.
        groups: The same, as masters are to see them.
        token: Instantiation token; ties the description to the binary.
    """
    root = md.root_element(about, "3.0", "instantiationToken", token)
    exchange = about.exchange is not None
    md.add_model_exchange(root, about, _EXCHANGE_FLAGS)
    md.add_co_simulation(root, about, _FLAGS)
    md.add_units(root, blocks, more=["s"])
    md.add_log_categories(root, "fmi3", md.STATUSES)
    md.add_experiment(root, about)
    variables = SubElement(root, "ModelVariables")
    for name, block in blocks.items():
        states = groups[block.derivative_of] if block.derivative_of and exchange else ()
        for place, variable in enumerate(groups[name]):
            element = _variable(block, variable)
            if states:
                element.set("derivative", str(states[place].reference))
            variables.append(element)
    time = sum(len(block.variables) for block in blocks.values())
    SubElement(variables, "Float64", {**md.time_attributes(time), "unit": "s"})
    _add_structure(root, blocks, groups, exchange)
    return md.xml_text(root)


def build_description(model_name: str, source_files: Iterable[str]) -> bytes:
    """Return sources/buildDescription.xml: the C files that make up the library."""
    root = Element("fmiBuildDescription", {"fmiVersion": "3.0"})
    configuration = SubElement(root, "BuildConfiguration", {"modelIdentifier": model_name})
    files = SubElement(configuration, "SourceFileSet", {"language": "C99"})
    for name in source_files:
        SubElement(files, "SourceFile", {"name": name})
    return md.xml_text(root)


def _variable(block: Block, group: VariableGroup) -> Element:
    attributes = md.variable_attributes(block, group.name, group.text, group.reference)
    first = group.elements[0]
    if not first.unit:
        element = Element("String", attributes)
        SubElement(element, "Start", {"value": str(first.start)})
        return element
    element = Element("Float64", {**attributes, **md.range_attributes(_common(group.elements))})
    if first.start is not None:
        element.set("start", " ".join(repr(v.start) for v in group.elements))
    if not group.is_scalar:
        SubElement(element, "Dimension", {"start": str(len(group.elements))})
    return element


def _common(elements: Sequence[Variable]) -> Variable:
    """Return a variable whose range is that of all elements; their units and nominals are the same."""
    first = elements[0]
    minima = [v.minimum for v in elements if v.minimum is not None]
    maxima = [v.maximum for v in elements if v.maximum is not None]
    return Variable(
        first.name,
        first.unit,
        first.text,
        minimum=min(minima) if len(minima) == len(elements) else None,
        maximum=max(maxima) if len(maxima) == len(elements) else None,
        nominal=first.nominal,
    )


def _add_structure(
    root: Element,
    blocks: Mapping[str, Block],
    groups: Groups,
    exchange: bool,
) -> None:
    references = {name: [v.reference for v in variables] for name, variables in groups.items()}
    references[TIME] = [sum(len(block.variables) for block in blocks.values())]
    structure = SubElement(root, "ModelStructure")
    indicators = [name for name, block in blocks.items() if block.is_event_indicator]
    # Time is a variable of every FMU of FMI 3.
    initial = {
        name: md.starting_names(blocks[name], True) for name in md.initial_names(blocks, exchange)
    }
    for element, names in (
        ("Output", md.output_names(blocks)),
        ("ContinuousStateDerivative", md.derivative_names(blocks) if exchange else []),
        ("InitialUnknown", list(initial)),
        ("EventIndicator", indicators if exchange else []),
    ):
        for name in names:
            dependencies = initial[name] if element == "InitialUnknown" else None
            for place, reference in enumerate(references[name]):
                depends = _dependencies(blocks[name], dependencies, references, place, exchange)
                attributes = {"valueReference": str(reference), "dependencies": depends}
                SubElement(structure, element, attributes)


def _dependencies(
    block: Block,
    initial: Sequence[str] | None,
    references: Mapping[str, Sequence[int]],
    place: int,
    exchange: bool,
) -> str:
    names = (
        list(initial) if initial is not None else [*md.known_names(block, exchange), *block.tuned]
    )
    in_block = [other for other in names if other in block.elementwise and initial is None]
    all_of = [k for other in names if other not in in_block for k in references[other]]
    return md.sorted_text([*all_of, *(references[other][place] for other in in_block)])
