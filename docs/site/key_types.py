"""What a schema says of a key, in words."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from typing import Any

from pydantic.fields import FieldInfo

Node = Mapping[str, Any]

_WORDS = {
    "string": "text",
    "integer": "integer",
    "number": "number",
    "boolean": "`true`, `false`",
    "object": "table",
}
_BOUNDS = {"exclusiveMinimum": ">", "minimum": ">=", "exclusiveMaximum": "<", "maximum": "<="}


def type_text(node: Node, whole: Node) -> str:
    """Return what values a key takes.

    Args:
        node: JSON schema of the key.
        whole: The one that it is part of, whose `$defs` it names.

    Example:
        >>> type_text({"type": "number", "exclusiveMinimum": 0.0, "maximum": 1.0}, {})
        'number, > 0, <= 1'
        >>> type_text({"type": "array", "items": {"type": "number"}, "minItems": 3, "maxItems": 3}, {})
        '3 numbers'
    """
    return " or ".join(dict.fromkeys(_alternatives(node, whole)))


def _alternatives(node: Node, whole: Node) -> Iterator[str]:
    if "anyOf" in node:
        for one in node["anyOf"]:
            yield from _alternatives(one, whole)
    elif "$ref" in node:
        keys = whole["$defs"][node["$ref"].rpartition("/")[2]]["properties"]
        yield "table of " + ", ".join(f"`{key}`" for key in keys)
    elif "const" in node or "enum" in node:
        yield ", ".join(f"`{value}`" for value in node.get("enum", [node.get("const")]))
    elif node.get("type") == "array":
        yield _array(node, whole)
    elif node.get("type") != "null":
        yield ", ".join([_word(node, whole), *_bounds(node)])


def _word(node: Node, whole: Node) -> str:
    if node.get("format") == "path":
        return "path"
    values = node.get("additionalProperties")
    if node["type"] == "object" and isinstance(values, Mapping) and "type" in values:
        entry = type_text(values, whole)
        return f"table of {entry if entry.endswith('s') else f'{entry}s'}"
    return _WORDS[node["type"]]


def _bounds(node: Node) -> Iterator[str]:
    for name, sign in _BOUNDS.items():
        if name in node:
            yield f"{sign} {node[name]:.15g}"
    if "multipleOf" in node:
        yield f"a multiple of {node['multipleOf']}"


def _array(node: Node, whole: Node) -> str:
    least, most = node.get("minItems"), node.get("maxItems")
    item, *bounds = type_text(node["items"], whole).split(", ", 1)
    if "`" in item or " " in item:
        what, bounds = f"entries: {', '.join([item, *bounds])}", []
    else:
        what = f"{item}s"
    if least is not None and least == most:
        count = f"{least} "
    elif least is not None and most is not None:
        count = f"{least} to {most} "
    else:
        count = "list of " if not least else f"at least {least} "
    return ", each ".join([f"{count}{what}", *bounds])


def default_text(field: FieldInfo) -> str:
    """Return a default as it would stand in a file; "" where there is one that is no value."""
    if field.is_required():
        return "must be given"
    default = field.default
    return "" if default is None else f"`{json.dumps(default, default=str)}`"
