"""A value in the text of a TOML file changed, with every comment kept."""

from __future__ import annotations

import re

import tomli_w

# A key, its value on one line, and a comment behind it.
_LINE = (
    r"(?P<key>{key}[ \t]*=[ \t]*)"
    r"(?P<value>(?:\"[^\"\n]*\"|'[^'\n]*'|[^#\n])*?)"
    r"(?P<end>[ \t]*(?:#.*)?)"
)


def with_value(text: str, table: str, key: str, value: object) -> str:
    r"""Return the text of a TOML file with another value of one key; a comment keeps its column.

    Args:
        text: The file.
        table: Table that has the key.
        key: Key whose value is on one line.
        value: Anything that TOML can say on one line.

    Raises:
        ValueError: If the table has no such key.

    Example:
        >>> print(with_value("[part]\nx = 1.0   # across", "part", "x", 1.25))
        [part]
        x = 1.25  # across
    """
    begin = re.search(rf"^\[{re.escape(table)}\][^\n]*\n", text, re.MULTILINE)
    if begin is None:
        raise ValueError(f"expected a table [{table}], got none")
    behind = re.compile(r"^\[", re.MULTILINE).search(text, begin.end())
    end = behind.start() if behind else len(text)
    line = re.compile(rf"^{_LINE.format(key=re.escape(key))}$", re.MULTILINE)
    found = line.search(text, begin.end(), end)
    if found is None:
        raise ValueError(f"expected a key {key!r} in [{table}], got none")
    said, comment = inline(value), found["end"].lstrip()
    if comment:
        width = len(found["value"]) + len(found["end"]) - len(comment)
        said = f"{said:<{width}}" if len(said) < width else f"{said}  "
    return text[: found.start()] + found["key"] + said + comment + text[found.end() :]


def inline(value: object) -> str:
    """Return a value as TOML on one line.

    Example:
        >>> inline([1.5, "a"])
        '[1.5, "a"]'
    """
    if isinstance(value, list):
        return f"[{', '.join(inline(entry) for entry in value)}]"
    return tomli_w.dumps({"value": value}).partition(" = ")[2].rstrip("\n")
