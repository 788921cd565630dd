"""The table of finished samples on disk: it only grows, and survives whatever ends the program.

A line is the CRC-32 of its text, a blank, and the sample as JSON.  It is on the disk before the next
one begins, so that only the last line can be torn: that is cut off, and its sample simulated anew, as is
that of a line which was damaged later.
"""

from __future__ import annotations

import errno
import os
from contextlib import suppress
from pathlib import Path

from coupling.errors import StudyError, reason_of
from coupling.results.study_result import StudySample


class SampleTable:
    """The table of finished samples, open for more; a context manager that closes it.

    Args:
        file: Its file; made where there is none.  What is torn at its end is cut off.

    Raises:
        StudyError: If the file cannot be read or written.
    """

    def __init__(self, file: Path) -> None:
        self._file = file
        try:
            text = file.read_bytes() if file.exists() else b""
            lines = text.splitlines(keepends=True)
            whole = len(text) - (0 if text.endswith(b"\n") or not lines else len(lines.pop()))
            # Unbuffered: what could not be written is not tried again when the file is closed.
            self._stream = file.open("ab", buffering=0)
            self._stream.truncate(whole)
        except OSError as cause:
            raise StudyError(f"{file}: cannot be opened: {reason_of(cause)}") from cause
        self.samples: dict[int, StudySample] = {}
        for line in lines:
            with suppress(ValueError):  # of a damaged line: its sample is missing
                sample = StudySample.of_line(line)
                self.samples[sample.number] = sample

    def __enter__(self) -> SampleTable:
        return self

    def __exit__(self, *error: object) -> None:
        self._stream.close()

    def has(self, number: int) -> bool:
        """Return whether a sample is there; one that failed is worth another try."""
        return number in self.samples and not self.samples[number].failure

    def add(self, sample: StudySample) -> None:
        """Write a sample to the disk."""
        line = sample.line()
        try:
            written = self._stream.write(line)
            if written != len(line):
                raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
            os.fsync(self._stream.fileno())
        except OSError as cause:
            raise StudyError(
                f"{self._file}: cannot be written: {reason_of(cause)}: make room, and the same"
                f" command continues with the {len(self.samples)} samples that are kept"
            ) from cause
        self.samples[sample.number] = sample
