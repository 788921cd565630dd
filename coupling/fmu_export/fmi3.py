"""modelDescription.xml of an FMI 3.0 co-simulation FMU, from blocks of variables."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from xml.etree.ElementTree import Element, SubElement

from coupling.fmu_export import model_description as md
from coupling.fmu_export.grouping import Group, Groups
from elastic_robot.fmi.interface import Block, Variable

_FLAGS = (
    "needsExecutionTool",
    "canBeInstantiatedOnlyOncePerProcess",
    "canGetAndSetFMUState",
    "canSerializeFMUState",
    "providesDirectionalDerivatives",
    "providesAdjointDerivatives",
    "providesPerElementDependencies",
    "canHandleVariableCommunicationStepSize",
    "providesIntermediateUpdate",
    "mightReturnEarlyFromDoStep",
    "canReturnEarlyAfterIntermediateUpdate",
    "hasEventMode",
    "providesEvaluateDiscreteStates",
)


def fmi3_description(
    about: md.About, blocks: Mapping[str, Block], groups: Groups, token: str
) -> bytes:
    """Return modelDescription.xml.

    Args:
        about: Description of the FMU.
        blocks: Its variables, element by element.
        groups: The same, as masters are to see them.
        token: Instantiation token; ties the description to the binary.
    """
    root = md.root_element(about, "3.0", "instantiationToken", token)
    md.add_co_simulation(root, about, _FLAGS)
    md.add_units(root, blocks, more=["s"])
    md.add_log_categories(root, "fmi3")
    md.add_experiment(root, about)
    variables = SubElement(root, "ModelVariables")
    for name, block in blocks.items():
        for variable in groups[name]:
            variables.append(_variable(block, variable))
    SubElement(
        variables,
        "Float64",
        {
            "name": "time",
            "valueReference": str(sum(len(block.variables) for block in blocks.values())),
            "description": "End of the last step",
            "causality": "independent",
            "variability": "continuous",
            "unit": "s",
        },
    )
    _add_structure(root, blocks, groups)
    return md.xml_text(root)


def build_description(model_name: str, source_files: Iterable[str]) -> bytes:
    """Return sources/buildDescription.xml: the C files that make up the library."""
    root = Element("fmiBuildDescription", {"fmiVersion": "3.0"})
    configuration = SubElement(root, "BuildConfiguration", {"modelIdentifier": model_name})
    files = SubElement(configuration, "SourceFileSet", {"language": "C99"})
    for name in source_files:
        SubElement(files, "SourceFile", {"name": name})
    return md.xml_text(root)


def _variable(block: Block, group: Group) -> Element:
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


def _add_structure(root: Element, blocks: Mapping[str, Block], groups: Groups) -> None:
    outputs = md.output_names(blocks)
    structure = SubElement(root, "ModelStructure")
    for element, by in (
        ("Output", {name: blocks[name].follows for name in outputs}),
        ("InitialUnknown", {name: blocks[name].starts_from for name in outputs}),
    ):
        for name in outputs:
            known = md.sorted_text(v.reference for other in by[name] for v in groups[other])
            for variable in groups[name]:
                reference = str(variable.reference)
                SubElement(structure, element, {"valueReference": reference, "dependencies": known})
