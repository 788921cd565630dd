"""A table from NumPy's NPZ: a zip archive of the arrays `columns` and `data`.

Nothing is unpickled, and nothing allocated that the file's own size does not bear out.
"""

from __future__ import annotations

import io
import zipfile

import numpy as np
from numpy.lib import format as npy

_READERS = {(1, 0): npy.read_array_header_1_0, (2, 0): npy.read_array_header_2_0}
_NUMBERS = ("f4", "f8", *(f"{kind}{size}" for kind in "iu" for size in (1, 2, 4, 8)))


def parse_npz(archive: bytes) -> tuple[list[str], np.ndarray]:
    """Return the texts of `columns` and the numbers of `data`, (rows, columns).

    Raises:
        ValueError: If the archive is damaged, or these arrays are not there or of other kinds.
    """
    columns = _array("columns", _member(archive, "columns"))
    if columns.dtype.kind != "U" or columns.dtype.itemsize == 0 or columns.ndim != 1:
        raise ValueError("the array 'columns' is not a list of texts")
    codes = columns.view(np.dtype("u4").newbyteorder(columns.dtype.byteorder))
    names = [_name(row) for row in codes.reshape(len(columns), -1).tolist()]
    data = _array("data", _member(archive, "data"))
    if data.dtype.str[1:] not in _NUMBERS or data.ndim != 2:
        raise ValueError("the array 'data' is not a table of numbers")
    return names, np.ascontiguousarray(data, dtype=float)


def _name(codes: list[int]) -> str:
    while codes and codes[-1] == 0:
        codes.pop()
    return "".join(chr(code) if code < 128 else "?" for code in codes)


def _member(archive: bytes, name: str) -> bytes:
    """Return the content of an array's member."""
    # Of what is encrypted or damaged zipfile raises exceptions of many kinds.
    try:
        members = zipfile.ZipFile(io.BytesIO(archive))
    except Exception:
        raise ValueError("it is no zip archive, or cut short") from None
    try:
        info = members.getinfo(f"{name}.npy")
        if info.compress_type == zipfile.ZIP_STORED and info.file_size == info.compress_size:
            return members.read(info)
    except KeyError:
        raise ValueError(f"the archive has no array '{name}'") from None
    except Exception as error:
        if "CRC-32" in str(error):
            raise ValueError(
                f"the archive's member {name}.npy is damaged: its checksum is another"
            ) from None
    if info.compress_type != zipfile.ZIP_STORED:
        raise ValueError(
            f"the archive's member {name}.npy is compressed: write it with numpy.savez,"
            " not savez_compressed"
        )
    raise ValueError(f"the archive's member {name}.npy is broken")


def _array(name: str, content: bytes) -> np.ndarray:
    """Return the array of a member's content."""
    stream = io.BytesIO(content)
    try:
        version = npy.read_magic(stream)
        read_header = _READERS[min(version, (2, 0))] if version <= (3, 0) else _READERS[version]
    except (ValueError, KeyError):
        raise ValueError(f"the array '{name}' is not in NumPy's format") from None
    try:
        shape, by_columns, kind = read_header(stream)
    except Exception:  # a header may hold anything
        raise ValueError(f"the array '{name}' has a header that is not NumPy's") from None
    if kind.hasobject or len(shape) > 2 or min(shape, default=0) < 0:
        raise ValueError(f"the array '{name}' has a header that is not NumPy's")
    size, remaining = kind.itemsize, len(content) - stream.tell()
    for length in shape:
        size *= length
    if size != remaining or kind.itemsize == 0:
        raise ValueError(f"the array '{name}' has {remaining} bytes, not those of its header")
    entries = np.frombuffer(content, kind, offset=stream.tell())
    return entries.reshape(shape, order="F" if by_columns else "C")
