"""Trajectory files of one joint: what is read, what is refused and why, and damaged ones."""

import io
import os
import struct
import zipfile
import zlib
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np

COLUMNS = ["time", "q1"]
DATA = np.array([[0.0, 0.0], [0.5, 0.25], [1.0, 1.0]])
RATES = np.column_stack([DATA, np.ones((3, 2))])


def npz(columns=COLUMNS, data: object = DATA, compressed: bool = False) -> bytes:
    """The archive that NumPy writes."""
    stream = io.BytesIO()
    (np.savez_compressed if compressed else np.savez)(stream, columns=columns, data=data)
    return stream.getvalue()


def csv(text: str) -> bytes:
    return text.encode()


def zipped(**members: bytes) -> bytes:
    """An archive of arrays, given by their bytes."""
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w") as archive:
        for name, content in members.items():
            archive.writestr(f"{name}.npy", content)
    return stream.getvalue()


def npy(values: object, header: str = "") -> bytes:
    """An array as NumPy writes it, or with another header."""
    stream = io.BytesIO()
    np.lib.format.write_array(stream, np.asarray(values), version=(1, 0))
    content = stream.getvalue()
    if not header:
        return content
    start = 10 + struct.unpack_from("<H", content, 8)[0]
    return b"\x93NUMPY\1\0" + struct.pack("<H", len(header)) + header.encode() + content[start:]


def _header(descr="<f8", shape="(3, 2)") -> str:
    return f"{{'descr': '{descr}', 'fortran_order': False, 'shape': {shape}, }}"


def _flipped(archive: bytes, member: bytes) -> bytes:
    """One bit of a member's content changed."""
    at = archive.rindex(member, 0, archive.index(b"PK\1\2")) + 200
    return archive[:at] + bytes([archive[at] ^ 1]) + archive[at + 1 :]


def _ends_in_shape() -> bytes:
    """A header of 1023 bytes that ends in the word 'shape'."""
    return npy(DATA, "{'descr': '<f8', 'fortran_order': False,".ljust(1016) + "'shape'")


def _claimed(size: int) -> bytes:
    """An archive whose directory claims a larger content."""
    archive = bytearray(npz())
    at = archive.index(b"PK\1\2")
    struct.pack_into("<I", archive, at + 24, size)
    return bytes(archive)


def _encrypted() -> bytes:
    archive = bytearray(npz())
    archive[archive.index(b"PK\1\2") + 8] |= 1
    return bytes(archive)


# What is read: all of these are the motion of DATA.
READ: dict[str, bytes] = {
    "plain.csv": csv("time,q1\n0,0\n0.5,0.25\n1,1\n"),
    "byte_order_mark.csv": csv("\ufefftime,q1\n0,0\n0.5,0.25\n1,1\n"),
    "windows.csv": csv("time,q1\r\n0,0\r\n0.5,0.25\r\n1,1\r\n"),
    "blanks_and_comments.csv": csv(" time , q1\n\n# a note\n 0,\t0\n.5 ,+25e-2\n1.,1"),
    "others.csv": csv("note,q1,x y,time\n7,0,1,0\n7,0.25,1,0.5\n7,1,1,1\n"),
    "umlaut.csv": csv("time,q1,Höhe\n0,0,1\n0.5,0.25,1\n1,1,1\n"),
    "plain.npz": npz(),
    "named_otherwise.dat": npz(),
    "by_columns.npz": npz(data=np.asfortranarray(DATA)),
    "float32.npz": npz(data=DATA.astype("f4")),
    "big_endian.npz": npz(np.array(COLUMNS).astype(">U4"), DATA.astype(">f8")),
    "big_float32.npz": npz(data=DATA.astype(">f4")),
    "not_a_number_elsewhere.npz": npz([*COLUMNS, "x"], np.column_stack([DATA, [np.nan] * 3])),
    "header_of_others.npz": zipped(
        columns=npy(COLUMNS),
        data=npy(DATA, "{ 'shape':(3,2),'descr':'<f8','fortran_order' : False}\n"),
    ),
}

# Integers are numbers too: the motion of these is that of their own.
INTEGERS = {
    f"{kind}.npz": npz(data=np.array([[0, 0], [1, 2], [2, 120]], dtype=kind))
    for kind in ("i1", "u1", "<i2", ">u2", "<i4", ">i8", "<u8")
}

# What is refused, with the reason.
REFUSED: dict[str, tuple[bytes, str]] = {
    "empty.csv": (b"", "expected a table, got an empty file"),
    "empty.npz": (b"", "expected a table, got an empty file"),
    "utf16.csv": (
        "time,q1\n0,0\n1,1\n".encode("utf-16"),
        "expected text, got a zero byte in line 1",
    ),
    "zero.csv": (csv("time,q1\n0,0\n1,1\n\0"), "expected text, got a zero byte in line 4"),
    "mac.csv": (csv("time,q1\r0,0\r1,1\r"), "expected one column 'q1', got time, q1?0"),
    "semicolons.csv": (
        csv("time,q1\n0;0\n1;0\n"),
        "line 2: expected a comma between two numbers, got ';'",
    ),
    "word.csv": (csv("time,q1\n0,0\n1,abc\n"), "line 3: expected a finite number, got 'abc'"),
    "nan.csv": (csv("time,q1\n0,0\n1,nan\n"), "line 3: expected a finite number, got 'nan'"),
    "huge.csv": (csv("time,q1\n0,0\n1,1e999\n"), "line 3: expected a finite number, got '1e999'"),
    "long.csv": (
        csv(f"time,q1\n0,0\n1,{'0' * 801}\n"),
        "line 3: expected a finite number, got '000",
    ),
    "hexadecimal.csv": (
        csv("time,q1\n0,0\n1,0x1\n"),
        "line 3: expected a comma between two numbers",
    ),
    "missing.csv": (csv("time,q1\n0,0\n1,\n"), "line 3: expected a finite number, got ''"),
    "ragged.csv": (csv("time,q1\n0,0\n1,1,1\n"), "line 3: 2 column names over 3 columns"),
    "no_time.csv": (csv("t,q1\n0,0\n1,1\n"), "expected one column 'time', got t, q1"),
    "no_joint.csv": (csv("time,q2\n0,0\n1,1\n"), "expected one column 'q1', got time, q2"),
    "twice.csv": (csv("time,q1,q1\n0,0,0\n1,1,1\n"), "expected one column 'q1', got time, q1, q1"),
    "rates_alone.csv": (csv("time,q1,qd1\n0,0,0\n1,1,0\n"), "expected qd and qdd, or none of them"),
    "wide.csv": (csv(",".join("x" * 257)), "expected at most 256 columns, got more"),
    "wide.npz": (npz(["x"] * 257, np.zeros((2, 257))), "expected at most 256 columns, got more"),
    "one.csv": (csv("time,q1\n0,0\n"), "expected at least 2 samples, got 1"),
    "none.npz": (npz(data=np.zeros((0, 2))), "expected at least 2 samples, got 0"),
    "falling.csv": (
        csv("time,q1\n1,0\n0,0\n"),
        "expected rising times, at least 1e-06 s apart, got 1 s",
    ),
    "close.csv": (csv("time,q1\n0,0\n1e-200,1\n"), "apart, got 0 s, then 1e-200 s at sample 2"),
    "late.csv": (csv("time,q1\n0,0\n2e12,1\n"), "time: expected finite numbers of at most 1e+12"),
    "far.npz": (
        npz(data=[[0.0, 0.0], [1.0, -1e13]]),
        "q: expected finite numbers of at most 1e+12",
    ),
    "nan.npz": (
        npz(data=[[0.0, 0.0], [1.0, np.nan]]),
        "q: expected finite numbers of at most 1e+12",
    ),
    "text.npz": (b"time,q1\n0,0\n1,1\n", "it is no zip archive, or cut short"),
    "cut.npz": (npz()[:-30], "it is no zip archive, or cut short"),
    "cut.dat": (npz()[:300], "it is no zip archive, or cut short"),
    "no_data.npz": (zipped(columns=npy(COLUMNS)), "the archive has no array 'data'"),
    "flipped.npz": (_flipped(npz(), b"data.npy"), "data.npy is damaged: its checksum is another"),
    "compressed.npz": (
        npz(compressed=True),
        "the archive's member columns.npy is compressed: write it with numpy.savez, not",
    ),
    "encrypted.npz": (_encrypted(), "the archive's member columns.npy is broken"),
    "claimed.npz": (_claimed(1 << 31), "the archive's member columns.npy is broken"),
    "complex.npz": (npz(data=DATA.astype(complex)), "'data' is not a table of numbers"),
    "half.npz": (npz(data=DATA.astype("f2")), "'data' is not a table of numbers"),
    "one_axis.npz": (npz(data=DATA.ravel()), "'data' is not a table of numbers"),
    "three_axes.npz": (npz(data=DATA[None]), "'data' has a header that is not NumPy's"),
    "pickled.npz": (
        zipped(columns=npy(COLUMNS), data=npy(DATA, _header("|O"))),
        "'data' has a header that is not NumPy's",
    ),
    "numbers_as_names.npz": (npz(columns=[1, 2]), "'columns' is not a list of texts"),
    "fewer_names.npz": (npz(columns=["time"]), "1 column names over 2 columns"),
    "ends_in_shape.npz": (
        zipped(columns=npy(COLUMNS), data=_ends_in_shape()),
        "'data' has a header that is not NumPy's",
    ),
    "absurd.npz": (
        zipped(columns=npy(COLUMNS), data=npy(DATA, _header(shape="(999999999999, 2)"))),
        "the array 'data' has 48 bytes, not those of its header",
    ),
    "overflowing.npz": (
        zipped(columns=npy(COLUMNS), data=npy(DATA, _header(shape="(1099511627776, 1048577)"))),
        "the array 'data' has 48 bytes, not those of its header",
    ),
    "absurd_names.npz": (
        zipped(columns=npy(COLUMNS, _header("<U9999999", shape="(2,)")), data=npy(DATA)),
        "the array 'columns' has 32 bytes, not those of its header",
    ),
    "version.npz": (
        zipped(columns=npy(COLUMNS), data=b"\x93NUMPY\7" + npy(DATA)[7:]),
        "the array 'data' is not in NumPy's format",
    ),
}


def _sparse(path: Path) -> None:
    with path.open("wb") as stream:
        stream.truncate((1 << 30) + 1)


# What is no readable file at all.
PLACES: dict[str, tuple[Callable[[Path], object], str]] = {
    "nothing.csv": (lambda path: None, "does not exist"),
    "folder.csv": (Path.mkdir, "expected a file, got a folder"),
    "pipe.csv": (os.mkfifo, "expected a file, got a pipe or device"),
    "below.csv/file.csv": (
        lambda path: path.parent.write_bytes(b"x"),
        "cannot be read: Not a directory",
    ),
    "enormous.csv": (_sparse, "expected at most 1073741824 bytes, got 1073741825"),
}


def damaged(rng: np.random.Generator, content: bytes) -> bytes:
    """Bytes changed, lost, doubled or cut off; half of the archives have right checksums again."""
    data = bytearray(content)
    for _ in range(rng.integers(1, 4)):
        at = int(rng.integers(len(data))) if data else 0
        kind = rng.integers(6)
        if kind <= 2:
            data[at : at + 1] = bytes([rng.integers(256)])
        elif kind == 3:
            data[at : at + 1] = rng.choice(
                list(b"\0\xff,.;-+eE0129'(){}:<>|fUiu \n\r#\"")
            ).tobytes()[:1]
        elif kind == 4:
            del data[at : at + int(rng.integers(1, 9))]
        else:
            more = data[at : at + int(rng.integers(1, 40))]
            data[int(rng.integers(len(data) + 1)) :][:0] = more
            data[at:at] = more
    if rng.random() < 0.5:
        _mend(data)
    return bytes(data)


def _mend(archive: bytearray) -> None:
    """Give stored members the checksum of what they hold now."""
    at = archive.find(b"PK\1\2")
    while at >= 0 and at + 46 <= len(archive):
        (size,) = struct.unpack_from("<I", archive, at + 20)
        (offset,) = struct.unpack_from("<I", archive, at + 42)
        if offset + 30 < len(archive):
            start = offset + 30 + sum(struct.unpack_from("<HH", archive, offset + 26))
            checksum = zlib.crc32(archive[start : start + size])
            struct.pack_into("<I", archive, at + 16, checksum)
        at = archive.find(b"PK\1\2", at + 4)


def damaged_files(seed: int, count: int) -> Iterator[tuple[bytes, bool]]:
    """Damaged contents, and whether they are called .npz."""
    rng = np.random.default_rng(seed)
    sound = [*READ.items(), ("rates.npz", npz([*COLUMNS, "qd1", "qdd1"], RATES)), *INTEGERS.items()]
    steps = np.column_stack([np.linspace(0.0, 1.0, 50), np.random.default_rng(0).normal(size=50)])
    sound.append(("noise.npz", npz(data=steps)))
    sound.append(("steps.npz", npz(data=steps.round(2))))
    for _ in range(count):
        name, content = sound[rng.integers(len(sound))]
        yield damaged(rng, content), name.endswith(".npz") and rng.random() < 0.9
