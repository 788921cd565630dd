"""The header of an array in NumPy's format, as `native/io/npz.c` reads it."""

from __future__ import annotations

import re

_MOST_AXIS = 1 << 40


class HeaderError(Exception):
    """The header is not one that NumPy writes."""


def parse_header(text: bytes) -> tuple[bytes, str, bool, tuple[int, ...]]:
    """Return byte order, kind and size of an entry, column-major order and shape.

    Raises:
        HeaderError: If it is not {'descr': '<f8', 'fortran_order': False, 'shape': (3, 2), }, with keys
            in any order and two axes at most.

    Example:
        >>> parse_header(b"{'descr': '<f8', 'fortran_order': False, 'shape': (3, 2), }")
        (b'<', 'f8', False, (3, 2))
    """
    return _Header(text).parse()


class _Header:
    """Reads a header from its beginning."""

    def __init__(self, text: bytes) -> None:
        self._text = text
        self._at = 0

    def parse(self) -> tuple[bytes, str, bool, tuple[int, ...]]:
        """As `parse_header`."""
        found: dict[bytes, re.Match[bytes] | tuple[int, ...]] = {}
        self._require(rb"\{")
        while not self._take(rb"\}"):
            key = self._require(rb"'([^']*)'")[1]
            self._require(rb":")
            if key in found:
                raise HeaderError
            if key == b"descr":
                found[key] = self._require(rb"'([<>|])([a-zA-Z])([0-9]{1,7})'")
            elif key == b"fortran_order":
                found[key] = self._require(rb"(True|False)")
            elif key == b"shape":
                found[key] = self._shape()
            else:
                raise HeaderError
            if not self._take(rb","):
                self._require(rb"\}")
                break
        self._take(rb"")
        if self._at != len(self._text) or len(found) != 3:
            raise HeaderError
        descr, order, shape = (found[key] for key in (b"descr", b"fortran_order", b"shape"))
        assert isinstance(descr, re.Match)
        assert isinstance(order, re.Match)
        assert isinstance(shape, tuple)
        kind, size = descr[2].decode(), int(descr[3])
        if descr[1] == b"|" and size != 1:
            raise HeaderError
        return descr[1], f"{kind}{size}", order[1] == b"True", shape

    def _shape(self) -> tuple[int, ...]:
        lengths: list[int] = []
        self._require(rb"\(")
        while not self._take(rb"\)"):
            length = self._require(rb"[0-9]{1,13}")[0]
            lengths.append(int(length))
            if len(lengths) > 2 or lengths[-1] > _MOST_AXIS:
                raise HeaderError
            if not self._take(rb","):
                self._require(rb"\)")
                break
        return tuple(lengths)

    def _take(self, pattern: bytes) -> re.Match[bytes] | None:
        """Pass blanks, then a pattern if it stands there."""
        while self._text[self._at : self._at + 1] in (b" ", b"\n"):
            self._at += 1
        match = re.compile(pattern).match(self._text, self._at)
        if match:
            self._at = match.end()
        return match

    def _require(self, pattern: bytes) -> re.Match[bytes]:
        match = self._take(pattern)
        if match is None:
            raise HeaderError
        return match
