"""An answer as the NPZ file that keeps it: its arrays, and beside them JSON that tells of it.

Every bit of an answer survives, and every bit is checked when it is read.
"""

from __future__ import annotations

import hashlib
import json
from dataclasses import asdict, dataclass
from io import BytesIO
from pathlib import Path
from typing import Any
from zipfile import BadZipFile, ZipFile

import numpy as np
from numpy.lib.format import read_array
from numpy.lib.npyio import NpzFile

from coupling.path.histories import ToolPath, WrenchHistory
from coupling.path.workpiece import Workpiece
from coupling.process.base import PHYSICS, ProcessResponse

# First words of what keys are hashes of.
_KEYED = "elastic-robot answer 1"
# Kinds of NumPy that are numbers; an array of objects would have to be pickled.
_NUMBERS = "biuf"
# Arrays that are computed with: whoever wrote them otherwise has rounded them.
_EXACT = ("time", "wrench", "stiffness")
# Name of the JSON among the arrays.
_HEADER = "header"
_FIELDS = ("point_fields", "cell_fields")


class DamagedError(Exception):
    """A file is no entry, or not the one that was written."""


@dataclass(frozen=True)
class EntryInfo:
    """Description of a response beside it.

    Attributes:
        seconds: Time that the evaluation took [s].
        written: When it was written [s since 1970].
    """

    key: str
    process: str
    samples: int
    tools: int
    seconds: float
    host: str
    written: float


def evaluation_key(identity: str, path: ToolPath) -> str:
    """Return the key of a process's answer to a path, a hash; empty where the process has no identity.

    Example:
        >>> pose = np.tile([0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0], (2, 1))
        >>> path = ToolPath(np.array([0.0, 1.0]), pose)
        >>> evaluation_key("", path)
        ''
        >>> key = evaluation_key("a wall", path)
        >>> key == evaluation_key("a wall", path), key == evaluation_key("a file", path)
        (True, False)
    """
    if not identity:
        return ""
    digest = hashlib.sha256(f"{_KEYED}\n{PHYSICS}\n{len(identity)}\n{identity}\n".encode())
    for values in (path.time, path.pose):
        numbers = np.ascontiguousarray(values, dtype=float)
        digest.update(f"{numbers.shape}\n".encode())
        digest.update(numbers.data)
    return digest.hexdigest()


def as_stored(response: ProcessResponse) -> ProcessResponse:
    """Return an answer as it would come out of the store, whose arrays are in C order.

    Sums of the same numbers in another order differ in their last digits.
    """
    wrench, piece, stiffness = response.wrench, response.workpiece, response.stiffness
    if piece is not None:
        fields = (
            {name: _as_stored(values) for name, values in by_name.items()}
            for by_name in (piece.point_fields, piece.cell_fields)
        )
        piece = Workpiece(_as_stored(piece.points), _as_stored(piece.cells), *fields)
    return ProcessResponse(
        WrenchHistory(_as_stored(wrench.time, float), _as_stored(wrench.wrench, float)),
        piece,
        None if response.period is None else float(response.period),
        None if stiffness is None else _as_stored(stiffness, float),
    )


_as_stored = np.ascontiguousarray


def encode_response(response: ProcessResponse, about: EntryInfo) -> memoryview:
    """Return the content of an entry.

    Raises:
        TypeError: If the answer has an array of something else than numbers.
    """
    piece = response.workpiece
    arrays: dict[str, Any] = {"time": response.wrench.time, "wrench": response.wrench.wrench}
    header: dict[str, Any] = {"about": asdict(about), "period": response.period}
    if response.stiffness is not None:
        arrays["stiffness"] = response.stiffness
    if piece is not None:
        arrays |= {"points": piece.points, "cells": piece.cells}
        for kind in _FIELDS:
            # Names may be any, so that they stand in the JSON.
            header[kind] = list(getattr(piece, kind))
            arrays |= {f"{kind} {k}": v for k, v in enumerate(getattr(piece, kind).values())}
    for name, values in arrays.items():
        if values.dtype.kind not in _NUMBERS:
            raise TypeError(f"{name}: expected an array of numbers, got {values.dtype}")
    header["arrays"] = list(arrays)
    content = BytesIO()
    np.savez(content, **{**arrays, _HEADER: np.array(json.dumps(header))})
    return content.getbuffer()


def decode_response(content: bytes, key: str) -> ProcessResponse:
    """Return the answer of an entry.

    Raises:
        DamagedError: If the content is not that of an entry with this key.
    """
    try:
        with ZipFile(BytesIO(content)) as archive:
            members = {
                name.removesuffix(".npy"): _array(archive, name) for name in archive.namelist()
            }
        header = json.loads(str(members[_HEADER]))
        # By their names: an archive may be damaged so that it seems to have fewer.
        arrays = {name: members[name] for name in header["arrays"]}
        if EntryInfo(**header["about"]).key != key:
            raise DamagedError("is the entry of another evaluation under this name")
        for name in arrays:
            kind = arrays[name].dtype
            if kind != np.float64 if name in _EXACT else kind.kind not in _NUMBERS:
                raise DamagedError(f"{name}: expected numbers as a store keeps them, got {kind}")
        workpiece = None
        if "points" in arrays:
            point_fields, cell_fields = (
                {name: arrays[f"{kind} {k}"] for k, name in enumerate(header[kind])}
                for kind in _FIELDS
            )
            workpiece = Workpiece(arrays["points"], arrays["cells"], point_fields, cell_fields)
        wrench = WrenchHistory(arrays["time"], arrays["wrench"])
        return ProcessResponse(wrench, workpiece, header["period"], arrays.get("stiffness"))
    except DamagedError:
        raise
    except Exception as cause:  # whatever else there is under the name
        raise DamagedError(f"is no entry of a store: {cause}") from cause


def _array(archive: ZipFile, name: str) -> np.ndarray:
    """Return the array of a member, which is read to its end, where its checksum is looked at."""
    try:
        content = archive.read(name)
    except BadZipFile as cause:
        raise DamagedError(f"the checksum of {name} is wrong") from cause
    return np.asarray(read_array(BytesIO(content), allow_pickle=False))


def read_about(file: Path) -> EntryInfo | None:
    """Return what an entry says about itself, without its arrays; None where it says nothing."""
    try:
        with file.open("rb") as stream, NpzFile(stream) as archive:
            return EntryInfo(**json.loads(str(archive[_HEADER]))["about"])
    except Exception:  # a damaged one may fail in any way
        return None


def size_of(path: ToolPath) -> int:
    """Return what an answer to a path takes on the disk [bytes], its workpiece estimated."""
    tools, samples = path.pose.shape[:2]
    return 8 * samples * (1 + tools * (6 + 9)) + _OF_WORKPIECE


# A sheet of some ten thousand elements.
_OF_WORKPIECE = 2_000_000
