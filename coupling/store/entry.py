"""An answer as bytes: a line with the checksum of all that follows, a line of JSON, the arrays.

Every bit of an answer survives, and every bit of the file is checked when it is read.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from coupling.path.histories import ToolPath, WrenchHistory
from coupling.path.workpiece import Workpiece
from coupling.process.base import PHYSICS, ProcessResponse

_FORMAT = "elastic-robot answer 1"
# First line: the format, the checksum in hexadecimal, the end of the line.
FIRST_LINE = len(_FORMAT) + 1 + 64 + 1
# Kinds of NumPy that are numbers; an array of objects would have to be pickled.
_NUMBERS = "biuf"


class DamagedError(Exception):
    """A file is no entry, or not the one that was written."""


@dataclass(frozen=True)
class EntryInfo:
    """What is told of an answer beside it.

    Attributes:
        key: Key of the answer.
        process: Name of the process.
        samples, tools: Size of the path.
        seconds: Time that the evaluation took [s].
        host: Machine that computed it.
        written: When it was written [s since 1970].
    """

    key: str
    process: str
    samples: int
    tools: int
    seconds: float
    host: str
    written: float


def answer_key(identity: str, path: ToolPath) -> str:
    """Return the key of a process's answer to a path, a hash; empty where the process has no identity.

    Example:
        >>> pose = np.tile([0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0], (2, 1))
        >>> path = ToolPath(np.array([0.0, 1.0]), pose)
        >>> answer_key("", path)
        ''
        >>> answer_key("a wall", path) == answer_key("a wall", path) != answer_key("a file", path)
        True
    """
    if not identity:
        return ""
    digest = hashlib.sha256(f"{_FORMAT}\n{PHYSICS}\n{len(identity)}\n{identity}\n".encode())
    for values in (path.time, path.pose):
        numbers = np.ascontiguousarray(values, dtype=float)
        digest.update(f"{numbers.shape}\n".encode())
        digest.update(numbers.data)
    return digest.hexdigest()


def plain(answer: ProcessResponse) -> ProcessResponse:
    """Return an answer as it would come out of the store, whose arrays are in C order.

    Sums of the same numbers in another order differ in their last digits.
    """
    wrench, piece, stiffness = answer.wrench, answer.workpiece, answer.stiffness
    if piece is not None:
        fields = (
            {name: _plain(values) for name, values in own.items()}
            for own in (piece.point_fields, piece.cell_fields)
        )
        piece = Workpiece(_plain(piece.points), _plain(piece.cells), *fields)
    return ProcessResponse(
        WrenchHistory(_plain(wrench.time), _plain(wrench.wrench)),
        piece,
        None if answer.period is None else float(answer.period),
        None if stiffness is None else _plain(stiffness),
    )


_plain = np.ascontiguousarray


def encoded(answer: ProcessResponse, about: EntryInfo) -> list[bytes | memoryview]:
    """Return the content of an entry in parts.

    Args:
        answer: A `plain` one.
        about: What is told beside it.

    Raises:
        TypeError: If the answer has an array of something else than numbers.
    """
    arrays = dict(_arrays(answer))
    for name, values in arrays.items():
        if values.dtype.kind not in _NUMBERS:
            raise TypeError(f"{name}: expected an array of numbers, got {values.dtype}")
    header = {
        "about": asdict(about),
        "period": answer.period,
        "arrays": [[name, v.dtype.str, list(v.shape)] for name, v in arrays.items()],
    }
    parts: list[bytes | memoryview] = [json.dumps(header).encode() + b"\n"]
    parts += [_bytes_of(values) for values in arrays.values()]
    digest = hashlib.sha256()
    for part in parts:
        digest.update(part)
    return [f"{_FORMAT} {digest.hexdigest()}\n".encode(), *parts]


def decoded(content: bytes, key: str) -> ProcessResponse:
    """Return the answer of an entry.

    Raises:
        DamagedError: If the content is not that of an entry with this key.
    """
    checked(content, key)
    header = json.loads(content[FIRST_LINE : content.index(b"\n", FIRST_LINE)])
    arrays, begin = {}, content.index(b"\n", FIRST_LINE) + 1
    for name, kind, shape in header["arrays"]:
        number, count = np.dtype(kind), int(np.prod(shape, dtype=np.int64))
        values = np.frombuffer(content, number, count, begin).reshape(shape)
        arrays[name] = values.copy()  # as a computed one: aligned, and may be written to
        begin += values.nbytes
    workpiece = None
    if "points" in arrays:
        fields = {
            place: {
                n.removeprefix(f"{place} "): v for n, v in arrays.items() if n.startswith(place)
            }
            for place in ("at point", "in cell")
        }
        workpiece = Workpiece(arrays["points"], arrays["cells"], *fields.values())
    wrench = WrenchHistory(arrays["time"], arrays["wrench"])
    return ProcessResponse(wrench, workpiece, header["period"], arrays.get("stiffness"))


def checked(content: bytes, key: str) -> None:
    """Check that content is that of an entry, every bit of it.

    Raises:
        DamagedError: If it is not.
    """
    first, rest = content[:FIRST_LINE], memoryview(content)[FIRST_LINE:]
    if len(first) < FIRST_LINE or not first.startswith(_FORMAT.encode() + b" "):
        raise DamagedError("is no entry of a store")
    if first != f"{_FORMAT} {hashlib.sha256(rest).hexdigest()}\n".encode():
        raise DamagedError("its checksum is wrong")
    if read_about(content).key != key:
        raise DamagedError("is the entry of another evaluation under this name")


def read_about(begin: bytes) -> EntryInfo:
    """Return what an entry says about itself.

    Args:
        begin: Its content, or as much of it as holds the first two lines.

    Raises:
        DamagedError: If it says nothing.
    """
    try:
        line = begin[FIRST_LINE : begin.index(b"\n", FIRST_LINE)]
        about: dict[str, Any] = json.loads(line)["about"]
        return EntryInfo(**about)
    except (ValueError, TypeError, KeyError) as cause:
        raise DamagedError("says nothing about itself") from cause


def size_of(path: ToolPath) -> int:
    """Return what an answer to a path takes on the disk [bytes], its workpiece estimated."""
    tools, samples = path.pose.shape[:2]
    return 8 * samples * (1 + tools * (6 + 9)) + _OF_WORKPIECE


# A sheet of some ten thousand elements.
_OF_WORKPIECE = 2_000_000


def _arrays(answer: ProcessResponse) -> Iterator[tuple[str, np.ndarray]]:
    yield "time", answer.wrench.time
    yield "wrench", answer.wrench.wrench
    if answer.stiffness is not None:
        yield "stiffness", answer.stiffness
    piece = answer.workpiece
    if piece is not None:
        yield "points", piece.points
        yield "cells", piece.cells
        yield from ((f"at point {name}", values) for name, values in piece.point_fields.items())
        yield from ((f"in cell {name}", values) for name, values in piece.cell_fields.items())


def _bytes_of(values: np.ndarray) -> memoryview:
    return np.ascontiguousarray(values).reshape(-1).view(np.uint8).data
