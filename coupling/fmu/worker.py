"""A Python process beside this one in which an FMU runs, which may crash its host.

The process runs `coupling.fmu.worker_main`.  Both sides speak pickles over its standard streams:
("ready", names of the variables) or ("error", text) out; then jobs in, and for each of them any number
of ("progress", done, total) and one ("result", value) or ("error", text) out.
"""

from __future__ import annotations

import os
import pickle
import subprocess
import sys
import tempfile
import zipfile
import zlib
from pathlib import Path
from typing import Any

import numpy as np

from coupling.fmu.job import FmuError, Progress, SimulationJob


def unpack(file: Path, folder: Path) -> None:
    """Unpack an FMU for a worker.

    Raises:
        FmuError: If the file is no readable archive.
    """
    try:
        with zipfile.ZipFile(file) as archive:
            archive.extractall(folder)
    except (OSError, EOFError, RuntimeError, ValueError, zipfile.BadZipFile, zlib.error) as cause:
        raise FmuError(f"is not a readable FMU: {cause}") from cause


class WorkerEndedError(FmuError):
    """The worker has ended before its answer."""


class WorkerProcess:
    """A running worker.

    Args:
        folder: Folder with the unpacked FMU.

    Attributes:
        variables: Names of the FMU's variables.

    Raises:
        FmuError: If the FMU cannot be loaded.
    """

    def __init__(self, folder: Path) -> None:
        one_thread = {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1", "MKL_NUM_THREADS": "1"}
        self._said = tempfile.TemporaryFile()  # noqa: SIM115  (closed by close)
        self._process = subprocess.Popen(
            # Without -P a random.py of the user in the working folder would be imported.
            [sys.executable, "-P", "-m", "coupling.fmu.worker_main", str(folder)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=self._said,
            env={**os.environ, **one_thread},
        )
        try:
            kind, content = self._answer()
            if kind == "error":
                raise FmuError(content)
            self.variables: frozenset[str] = content
        except FmuError:
            self.close()
            raise

    def close(self) -> None:
        """End the process."""
        self._process.kill()
        self._process.communicate()
        self._said.close()

    def send(self, job: SimulationJob) -> None:
        """Give the worker a job."""
        assert self._process.stdin is not None
        try:
            pickle.dump(job, self._process.stdin)
            self._process.stdin.flush()
        except OSError as cause:
            raise self._death() from cause

    def receive(self, progress: Progress) -> np.ndarray:
        """Return the outputs of the job sent last, any unit, (n, job.width)."""
        while True:
            kind, *content = self._answer()
            if kind == "result":
                answers: np.ndarray = content[0]
                return answers
            if kind == "error":
                raise FmuError(content[0])
            progress(*content)

    def _answer(self) -> tuple[Any, ...]:
        assert self._process.stdout is not None
        try:
            answer: tuple[Any, ...] = pickle.load(self._process.stdout)
        except (EOFError, pickle.UnpicklingError) as cause:
            raise self._death() from cause
        return answer

    def _death(self) -> WorkerEndedError:
        self._said.seek(0)
        lines = self._said.read().decode(errors="replace").strip().splitlines()
        last = f": {lines[-1]}" if lines else ""
        return WorkerEndedError(f"the process that runs the FMU has ended{last}")
