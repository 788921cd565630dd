"""A robot file's content -> TOML with remarks beside its lines."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import tomli_w


def robot_text(data: Mapping[str, Any], remarks: Mapping[str, str], head: str) -> str:
    """Return a robot file.

    Args:
        data: Its content, as parsed.
        remarks: Comments, by the place of a number as in [sources], joint[3].tilt[1].stiffness; that of
            a tilt stands beside the tilt.
        head: Comment at the beginning.

    Example:
        >>> arm = {"name": "arm", "joint": [{"axis": [0, 0, 1], "stiffness": 2e6}]}
        >>> print(robot_text(arm, {"joint[1].stiffness": "a guess"}, "Arm."))
        # Arm.
        <BLANKLINE>
        name = "arm"
        <BLANKLINE>
        [[joint]]
        axis = [0, 0, 1]
        stiffness = 2000000.0   # a guess
        <BLANKLINE>
    """
    lines = [f"# {line}".rstrip() for line in head.splitlines()]
    lines += ["", *_keys(data, "", remarks)]
    for key, value in data.items():
        if isinstance(value, Mapping):
            lines += ["", f"[{_key(key)}]", *_keys(value, f"{key}.", remarks)]
        elif _is_tables(value):
            for number, entry in enumerate(value, start=1):
                lines += ["", f"[[{_key(key)}]]", *_keys(entry, f"{key}[{number}].", remarks)]
    return "\n".join(lines) + "\n"


def _keys(table: Mapping[str, Any], before: str, remarks: Mapping[str, str]) -> list[str]:
    """Return the lines of a table's own keys."""
    lines = []
    for key, value in table.items():
        place = before + key
        if key == "tilt" and before:
            lines += _tilts(value, place, remarks)
        elif (before or not isinstance(value, Mapping)) and not _is_tables(value):
            lines.append(_remarked(f"{_key(key)} = {_value(value)}", remarks.get(place)))
    return lines


def _tilts(tilts: list[Mapping[str, Any]], place: str, remarks: Mapping[str, str]) -> list[str]:
    if not tilts:
        return ["tilt = []"]
    lines = ["tilt = ["]
    for number, tilt in enumerate(tilts, start=1):
        remark = remarks.get(f"{place}[{number}].stiffness")
        lines.append(_remarked(f"    {_value(tilt)},", remark))
    return [*lines, "]"]


def _remarked(line: str, remark: str | None) -> str:
    return line if not remark else f"{line}   # {' '.join(remark.split())}"


def _is_tables(value: object) -> bool:
    return isinstance(value, list) and bool(value) and all(isinstance(v, Mapping) for v in value)


def _key(key: str) -> str:
    """Return a key as TOML writes it, quoted where it must be."""
    return tomli_w.dumps({key: 0}).split(" = ")[0]


def _value(value: Any) -> str:
    if isinstance(value, list):
        return f"[{', '.join(_value(entry) for entry in value)}]"
    if isinstance(value, Mapping):
        keys = (f"{_key(key)} = {_value(entry)}" for key, entry in value.items())
        return f"{{ {', '.join(keys)} }}"
    return tomli_w.dumps({"value": value}).removeprefix("value = ").rstrip("\n")
