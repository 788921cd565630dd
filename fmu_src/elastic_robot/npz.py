"""A table from NumPy's NPZ: a zip archive of the arrays `columns` and `data`.

Read by hand and not by NumPy, so that a file is taken or refused as the C core does
(`native/io/zip.c`, `native/io/npz.c`), and nothing is allocated that the file's own size does not bear
out.  Zip: PKWARE, APPNOTE.TXT; arrays: numpy.lib.format.
"""

from __future__ import annotations

import struct
import zlib
from dataclasses import dataclass

import numpy as np

from elastic_robot.npy_header import HeaderError, parse_header

# Sizes of the zip records' fixed parts.
_LOCAL_HEADER, _CENTRAL_HEADER, _END_RECORD, _MOST_COMMENT = 30, 46, 22, 65535
_STORED, _DEFLATED, _ENCRYPTED = 0, 8, 1
# A size that stands in the zip64 extra field instead.
_IN_EXTRA, _ZIP64_FIELD = 0xFFFFFFFF, 1
# Deflate's longest copy, 258 bytes, takes at least 2 bits.
_MOST_RATIO = 1032
_MAGIC = b"\x93NUMPY"
_NUMBERS = ("f4", "f8", *(f"{kind}{size}" for kind in "iu" for size in (1, 2, 4, 8)))


@dataclass(frozen=True)
class _Array:
    """An array as its header describes it.

    Attributes:
        item: Kind of an entry and its size, as `f8`.
        big: The most significant byte comes first.
        column_major: The first index runs fastest.
        shape: Length of every axis.
        content: The entries.
    """

    item: str
    big: bool
    column_major: bool
    shape: tuple[int, ...]
    content: bytes


def parse_npz(archive: bytes) -> tuple[list[str], np.ndarray]:
    """Return the texts of `columns` and the numbers of `data`, (rows, columns).

    Raises:
        ValueError: If the archive is damaged, or these arrays are not there or of other kinds.
    """
    columns = _open_array("columns", _member(archive, b"columns.npy"))
    letters = int(columns.item[1:]) if columns.item[0] == "U" else 0
    if letters == 0 or len(columns.shape) != 1:
        raise ValueError("the array 'columns' is not a list of texts")
    _require_size("columns", columns, 4 * letters)
    code = ">u4" if columns.big else "<u4"
    codes = np.frombuffer(columns.content, code).reshape(columns.shape[0], letters)
    names = [_name(row) for row in codes.tolist()]
    data = _open_array("data", _member(archive, b"data.npy"))
    if data.item not in _NUMBERS or len(data.shape) != 2:
        raise ValueError("the array 'data' is not a table of numbers")
    _require_size("data", data, int(data.item[1:]))
    kind = np.dtype(data.item).newbyteorder(">" if data.big else "<")
    entries = np.frombuffer(data.content, kind)
    rows, width = data.shape
    table = entries.reshape(width, rows).T if data.column_major else entries.reshape(rows, width)
    return names, np.ascontiguousarray(table, dtype=float)


def _name(codes: list[int]) -> str:
    while codes and codes[-1] == 0:
        codes.pop()
    return "".join(chr(code) if code < 128 else "?" for code in codes)


def _member(archive: bytes, wanted: bytes) -> bytes:
    """Return the content of a member."""
    name = wanted.decode()
    at, entries = _directory(archive)
    for _ in range(entries):
        if len(archive) - at < _CENTRAL_HEADER or archive[at : at + 4] != b"PK\1\2":
            raise ValueError("the archive's directory is broken")
        name_size, extra_size, comment_size = struct.unpack_from("<HHH", archive, at + 28)
        rest = at + _CENTRAL_HEADER
        if name_size + extra_size > len(archive) - rest:
            raise ValueError("the archive's directory is broken")
        if archive[rest : rest + name_size] == wanted:
            extra = archive[rest + name_size : rest + name_size + extra_size]
            return _unpack(archive, at, extra, name)
        at = rest + name_size + extra_size + comment_size
        if at > len(archive):
            raise ValueError("the archive's directory is broken")
    raise ValueError(f"the archive has no array '{name.removesuffix('.npy')}'")


def _directory(archive: bytes) -> tuple[int, int]:
    """Return the place of the directory and the number of its entries."""
    last = len(archive) - _END_RECORD
    for at in range(last, max(-1, last - _MOST_COMMENT - 1), -1):
        if (
            archive[at : at + 4] == b"PK\5\6"
            and struct.unpack_from("<H", archive, at + 20)[0] == last - at
        ):
            (entries,) = struct.unpack_from("<H", archive, at + 10)
            (start,) = struct.unpack_from("<I", archive, at + 16)
            if start > len(archive):
                raise ValueError("the archive's directory is broken")
            return start, entries
    raise ValueError("it is no zip archive, or cut short")


def _unpack(archive: bytes, central: int, extra: bytes, name: str) -> bytes:
    flags, method = struct.unpack_from("<HH", archive, central + 8)
    checksum, *sizes = struct.unpack_from("<III", archive, central + 16)
    (offset,) = struct.unpack_from("<I", archive, central + 42)
    full, packed, offset = _widened(extra, [sizes[1], sizes[0], offset])
    broken = ValueError(f"the archive's member {name} is broken")
    if offset > len(archive) or len(archive) - offset < _LOCAL_HEADER:
        raise broken
    if archive[offset : offset + 4] != b"PK\3\4" or flags & _ENCRYPTED:
        raise broken
    start = offset + _LOCAL_HEADER + sum(struct.unpack_from("<HH", archive, offset + 26))
    if start > len(archive) or packed > len(archive) - start:
        raise broken
    content = archive[start : start + packed]
    if method == _DEFLATED and full <= _MOST_RATIO * packed:
        content = _inflated(content, full, broken)
    elif method != _STORED:
        raise broken
    if len(content) != full:
        raise broken
    if zlib.crc32(content) != checksum:
        raise ValueError(f"the archive's member {name} is damaged: its checksum is another")
    return content


def _inflated(packed: bytes, size: int, broken: ValueError) -> bytes:
    stream = zlib.decompressobj(-zlib.MAX_WBITS)
    try:
        content = stream.decompress(packed, size + 1)
    except zlib.error:
        raise broken from None
    if not stream.eof or stream.unused_data or stream.unconsumed_tail:
        raise broken
    return content


def _widened(extra: bytes, values: list[int]) -> list[int]:
    """Return full and packed size and offset; those that did not fit stand, in order, in `extra`."""
    while len(extra) >= 4:
        kind, size = struct.unpack_from("<HH", extra)
        if size + 4 > len(extra):
            break
        at = 4
        for k in range(3) if kind == _ZIP64_FIELD else ():
            if values[k] == _IN_EXTRA and at + 8 <= size + 4:
                (values[k],) = struct.unpack_from("<Q", extra, at)
                at += 8
        extra = extra[size + 4 :]
    return values


def _open_array(name: str, content: bytes) -> _Array:
    start = 10 if content[6:7] == b"\1" else 12
    if len(content) < 12 or content[:6] != _MAGIC or content[6] not in (1, 2, 3):
        raise ValueError(f"the array '{name}' is not in NumPy's format")
    (length,) = struct.unpack_from("<H" if start == 10 else "<I", content, 8)
    if length > len(content) - start:
        raise ValueError(f"the array '{name}' is cut short")
    try:
        order, item, column_major, shape = parse_header(content[start : start + length])
    except HeaderError:
        raise ValueError(f"the array '{name}' has a header that is not NumPy's") from None
    return _Array(item, order == b">", column_major, shape, content[start + length :])


def _require_size(name: str, array: _Array, item: int) -> None:
    count = 1
    for length in array.shape:
        count *= length
    if count * item != len(array.content):
        raise ValueError(
            f"the array '{name}' has {len(array.content)} bytes, not those of its header"
        )
