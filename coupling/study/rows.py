"""The table of finished samples on disk: it only grows, and survives whatever ends the program.

A line is the CRC-32 of its text, a blank, and the sample as JSON.  It is on the disk before the next
one begins, so that only the last line can be torn: that is cut off, and its sample simulated anew, as is
that of a line which was damaged later.
"""

from __future__ import annotations

import dataclasses
import errno
import json
import os
import zlib
from dataclasses import dataclass
from pathlib import Path

from coupling.errors import StudyError
from coupling.path.deviation import Deviation


@dataclass(frozen=True)
class StudySample:
    """What the command leaves on one sampled robot.

    Attributes:
        number: Number of the sample, from 0.
        deviation: Deviation from the desired paths, the worst figures of all tools; None where the
            robot cannot be simulated.
        distance: Largest distance from them in each part of the path [m]; empty there.
        failure: Why it cannot be simulated, or empty.
        evaluations: Evaluations of the process that it took.
        converged: Whether robot and process came together; true where the process was not asked.
    """

    number: int
    deviation: Deviation | None
    distance: tuple[float, ...]
    failure: str = ""
    evaluations: int = 0
    converged: bool = True

    def line(self) -> bytes:
        """Return its line of the table; numbers survive exactly."""
        text = json.dumps(dataclasses.asdict(self), separators=(",", ":")).encode()
        return b"%08x %s\n" % (zlib.crc32(text), text)

    @classmethod
    def of(cls, line: bytes) -> StudySample:
        """Return the sample of a line.

        Raises:
            ValueError: If it is torn or damaged.
        """
        crc, _, text = line.partition(b" ")
        if not text.endswith(b"\n") or int(crc, 16) != zlib.crc32(text[:-1]):
            raise ValueError("the line does not agree with its checksum")
        data = json.loads(text)
        found = data["deviation"]
        data["deviation"] = None if found is None else Deviation(**found)
        return cls(**{**data, "distance": tuple(data["distance"])})


class SampleTable:
    """The table of finished samples, open for more; a context manager that closes it.

    Args:
        file: Its file; made where there is none.  What is torn at its end is cut off.

    Attributes:
        samples: Finished samples by number.
        damaged: Number of lines that do not agree with their checksum; their samples are missing.

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
            raise StudyError(f"{file}: cannot be opened: {cause.strerror or cause}") from cause
        self.samples: dict[int, StudySample] = {}
        self.damaged = 0
        for line in lines:
            try:
                sample = StudySample.of(line)
            except (ValueError, KeyError, TypeError):
                self.damaged += 1
            else:
                self.samples[sample.number] = sample

    def __enter__(self) -> SampleTable:
        return self

    def __exit__(self, *error: object) -> None:
        self._stream.close()

    def has(self, number: int) -> bool:
        """Return whether a sample is there; one that failed is worth another try."""
        return number in self.samples and not self.samples[number].failure

    def add(self, sample: StudySample) -> None:
        """Write a sample to the disk; one that is there already is left as it is, unless it failed.

        Raises:
            StudyError: If that fails; what was written before is kept.
        """
        if self.has(sample.number):
            return
        line = sample.line()
        try:
            written = self._stream.write(line)
            if written != len(line):
                raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
            os.fsync(self._stream.fileno())
        except OSError as cause:
            raise StudyError(
                f"{self._file}: cannot be written: {cause.strerror or cause}: make room, and the same"
                f" command goes on with the {len(self.samples)} samples that are kept"
            ) from cause
        self.samples[sample.number] = sample
