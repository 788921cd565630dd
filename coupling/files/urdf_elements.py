"""Elements of a URDF: XML whose prefixes need no declaration, names and numbers in its elements."""

from __future__ import annotations

from xml.etree.ElementTree import Element, TreeBuilder
from xml.parsers import expat

import numpy as np
import pinocchio as pin

# A description of links and joints has no such depth.
_MAX_DEPTH = 200
# No one writes more than a turn and a half to turn a frame [rad]; degrees are more.
_MAX_TURN = 10.0


def plain_name(name: str) -> str:
    r"""Return a name as it is compared: an XML attribute cannot tell a tab from a blank.

    Example:
        >>> plain_name("joint\t1")
        'joint 1'
    """
    return " ".join(name.split())


def parse_xml(text: bytes) -> Element:
    r"""Return the root of an XML text whose prefixes need not be declared.

    Raises:
        ValueError: If it is no XML, declares entities or is nested without end.

    Example:
        >>> parse_xml(b"\n<?xml version='1.0'?><robot><gazebo:plugin/></robot>")[0].tag
        'gazebo:plugin'
    """
    builder, depth = TreeBuilder(), 0

    def start(tag: str, attributes: dict[str, str]) -> None:
        nonlocal depth
        depth += 1
        if depth > _MAX_DEPTH:
            raise ValueError(f"expected at most {_MAX_DEPTH} elements inside each other, got more")
        builder.start(tag, attributes)

    def end(tag: str) -> None:
        nonlocal depth
        depth -= 1
        builder.end(tag)

    def entity(name: str, *_: object) -> None:
        raise ValueError(f"expected no entities, got a declaration of {name[:40]!r}")

    parser = expat.ParserCreate()  # without namespaces: a prefix is a part of the name
    parser.StartElementHandler, parser.EndElementHandler = start, end
    parser.EntityDeclHandler = entity
    try:
        parser.Parse(text.removeprefix(b"\xef\xbb\xbf").lstrip(), True)
    except (expat.ExpatError, LookupError, UnicodeError) as cause:  # such an encoding is unknown
        raise ValueError(str(cause)) from cause
    return builder.close()


def name_of(element: Element, kind: str) -> str:
    """Return the name of an element; refuse one of a kind that has none."""
    name = plain_name(element.get("name", ""))
    if not name:
        raise ValueError(f"{kind}: expected a name, got none")
    return name


def link_of(element: Element, role: str) -> str:
    """Return the link that a joint has as its parent or child."""
    link = plain_name(child_of(element, role).get("link", ""))
    if not link:
        raise ValueError(f"{role}: expected a link, got none")
    return link


def child_of(element: Element, tag: str) -> Element:
    """Return the first element of a kind in another; refuse none."""
    child = element.find(tag)
    if child is None:
        raise ValueError(f"expected <{tag}>, got none")
    return child


def placement_of(element: Element) -> pin.SE3:
    """Return the placement that an element's <origin> gives; none is the identity."""
    origin = element.find("origin")
    if origin is None:
        return pin.SE3.Identity()
    if others := sorted(set(origin.attrib) - {"xyz", "rpy"}):
        raise ValueError(
            f"origin: expected xyz and rpy, got {others[0][:40]!r}: convert it to these"
        )
    rpy = vector_of(origin, "rpy", (0.0, 0.0, 0.0))
    if np.abs(rpy).max() > _MAX_TURN:
        raise ValueError(
            f"origin: rpy: expected radians, {_MAX_TURN:g} at most, got"
            f" {float(rpy[np.argmax(np.abs(rpy))]):g}: convert degrees"
        )
    return pin.SE3(pin.rpy.rpyToMatrix(rpy), vector_of(origin, "xyz", (0.0, 0.0, 0.0)))


def vector_of(element: Element, key: str, default: tuple[float, float, float]) -> np.ndarray:
    """Return three numbers of an attribute, its unit, (3,); the default where it is not there."""
    text = element.get(key)
    if text is None:
        return np.array(default)
    parts = text.split()
    if len(parts) != 3:
        raise ValueError(f"{element.tag}: {key}: expected 3 numbers, got {text[:60]!r}")
    return np.array([_float(part, f"{element.tag}: {key}") for part in parts])


def number_of(element: Element, key: str, default: float | None = None) -> float:
    """Return the number of an attribute, its unit; the default, or a refusal, where it is not there."""
    text = element.get(key)
    if text is None and default is not None:
        return default
    if text is None:
        raise ValueError(f"{element.tag}: expected {key}, got none")
    return _float(text, element.tag if key == "value" else f"{element.tag}: {key}")


def _float(text: str, place: str) -> float:
    try:
        value = float(text) if "_" not in text else np.nan
    except ValueError:
        value = np.nan
    # Squares and sums of what is beyond this are no numbers any more.
    if not abs(value) < 1e100:
        raise ValueError(f"{place}: expected a finite number, got {text[:40]!r}")
    return value
