"""The C sources as an FMU packs them: every name with external linkage begins with the FMU's identifier.

So the sources of several FMUs can be linked into one program, as both standards have it (FMI 2.0.5,
2.1.1, FMI 3.0.2, 2.2.2: FMI2_FUNCTION_PREFIX, FMI3_FUNCTION_PREFIX).  For a shared library the
functions of FMI bear no prefix; whoever compiles one defines FMI2_OVERRIDE_FUNCTION_PREFIX or
FMI3_OVERRIDE_FUNCTION_PREFIX.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from pathlib import Path

from coupling.fmu_export.compiler import SOURCES

_NAMES = "names.h"
# The core's own names; those of FMI have the standard's macro.
_OWN = re.compile(r"\ber_[a-z0-9_]+\b")
# How a file of FMI's functions begins to include, by the version of FMI.
_FIRST_INCLUDE = re.compile(r'^#include "', re.MULTILINE)


def packed_sources(
    functions: Sequence[Path], sources: Sequence[Path], name: str
) -> dict[str, bytes]:
    """Return the files by path inside the archive.

    Args:
        functions: C files with the functions of a version of FMI.
        sources: All C files, these among them.
        name: The FMU's model identifier.
    """
    files = [*sources, *sorted(SOURCES.rglob("*.h"))]
    texts = {file: file.read_text(encoding="utf-8") for file in files}
    packed = {f"sources/{_NAMES}": _names_header(texts, name)}
    for file, text in texts.items():
        path = file.relative_to(SOURCES)
        if file.suffix == ".c":
            up = "../" * (len(path.parts) - 1)
            text = f'#include "{up}{_NAMES}"\n{text}'
        if file in functions:
            text = _prefixed(text, path.name, name)
        packed[f"sources/{path.as_posix()}"] = text
    return {path: text.encode() for path, text in packed.items()}


def _prefixed(text: str, file: str, name: str) -> str:
    """Define the prefix of the standard's functions where they are included first."""
    version = file[3]
    standards = f'#include "fmi{version}Functions.h"\n'
    definition = f"#define FMI{version}_FUNCTION_PREFIX {name}_\n"
    if standards in text:
        return text.replace(standards, definition + standards, 1)
    start = text.index("\n") + 1  # behind the names
    first = _FIRST_INCLUDE.search(text, start)
    assert first is not None, file
    return text[: first.start()] + definition + text[first.start() :]


def _names_header(texts: Mapping[Path, str], name: str) -> str:
    headers = (text for file, text in texts.items() if file.suffix == ".h")
    names = sorted({found for text in headers for found in _OWN.findall(text)})
    return "\n".join(
        [
            f"/* The core's names begin with {name}: other FMUs of one program have their own. */",
            *(f"#define {found} {name}_{found}" for found in names),
            "",
        ]
    )
