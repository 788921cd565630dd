"""A Python process beside this one that does jobs: where an FMU runs, which may crash its host.

`WorkerProcess` is the side of the desk.  The other side is this module run as a program: it loads a
module by name and asks it for the function that does jobs.  Both speak pickles over the standard
streams: jobs in; ("progress", done, total), then ("result", value) or ("error", text) out.
"""

from __future__ import annotations

import contextlib
import importlib
import io
import os
import pickle
import subprocess
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any, BinaryIO

import fmpy

from coupling.errors import CouplingError

Progress = Callable[[int, int], None]
Work = Callable[[Any, Progress], Any]


class WorkerError(CouplingError):
    """A job failed, with the reason in the worker's words, or the worker has died."""


def unpack(file: Path, folder: Path) -> None:
    """Unpack an FMU for a worker.

    Raises:
        WorkerError: If the file is no readable archive.
    """
    try:
        fmpy.extract(str(file), unzipdir=str(folder))
    except Exception as cause:  # fmpy raises bare Exception for every kind of broken file
        raise WorkerError(f"is not a readable FMU: {cause}") from cause


class WorkerProcess:
    """A running worker.

    Args:
        module: Its name; the module's function `load(folder)` returns a function
            `work(job, progress)`, which raises WorkerError where a job cannot be done.
        folder: Given to `load`.

    Raises:
        WorkerError: If it cannot be loaded.
    """

    def __init__(self, module: str, folder: Path) -> None:
        one_thread = {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1", "MKL_NUM_THREADS": "1"}
        self._said = tempfile.TemporaryFile()  # noqa: SIM115  (closed by close)
        self._process = subprocess.Popen(
            [sys.executable, "-m", "coupling.fmu.worker", module, str(folder)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=self._said,
            env={**os.environ, **one_thread},
        )
        try:
            kind, *text = self._answer()
            if kind != "ready":
                raise WorkerError(text[0])
        except WorkerError:
            self.close()
            raise

    def close(self) -> None:
        """End the process."""
        self._process.kill()
        self._process.communicate()
        self._said.close()

    def send(self, job: object) -> None:
        """Give the worker a job."""
        assert self._process.stdin is not None
        try:
            pickle.dump(job, self._process.stdin)
            self._process.stdin.flush()
        except OSError as cause:
            raise self._death() from cause

    def receive(self, progress: Progress) -> Any:
        """Return the result of the job sent last."""
        while True:
            kind, *content = self._answer()
            if kind == "result":
                return content[0]
            if kind == "error":
                raise WorkerError(content[0])
            progress(*content)

    def _answer(self) -> tuple[Any, ...]:
        assert self._process.stdout is not None
        try:
            answer: tuple[Any, ...] = pickle.load(self._process.stdout)
        except (EOFError, pickle.UnpicklingError) as cause:
            raise self._death() from cause
        return answer

    def _death(self) -> WorkerError:
        self._said.seek(0)
        lines = self._said.read().decode(errors="replace").strip().splitlines()
        last = f": {lines[-1]}" if lines else ""
        return WorkerError(f"the process that runs the FMU has ended{last}")


def _serve(module: str, folder: Path, jobs: BinaryIO, answers: BinaryIO) -> None:
    """Answer jobs until there are no more."""

    def tell(*answer: object) -> None:
        pickle.dump(answer, answers)
        answers.flush()

    try:
        work: Work = importlib.import_module(module).load(folder)
    except Exception as error:  # whatever is wrong with the FMU: the user's to read
        tell("error", str(error))
        return
    tell("ready")
    while True:
        try:
            job = pickle.load(jobs)
        except EOFError:
            return
        answer: tuple[str, object]
        said = io.StringIO()  # an FMU tells the reason of an error on stderr only
        with contextlib.redirect_stderr(said):
            try:
                answer = ("result", work(job, lambda done, total: tell("progress", done, total)))
            except WorkerError as error:
                reason = said.getvalue().strip().splitlines()
                answer = ("error", reason[-1] if reason else str(error))
        tell(*answer)


if __name__ == "__main__":
    # Whatever else prints to stdout must not come between the answers.
    _answers = os.fdopen(os.dup(sys.stdout.fileno()), "wb")
    os.dup2(sys.stderr.fileno(), sys.stdout.fileno())
    # Modules that are loaded raise the WorkerError of the module that they import.
    sys.modules["coupling.fmu.worker"] = sys.modules["__main__"]
    with contextlib.suppress(BrokenPipeError, KeyboardInterrupt):
        _serve(sys.argv[1], Path(sys.argv[2]), sys.stdin.buffer, _answers)
    os._exit(0)  # past the destructors of PythonFMU's binary, which may crash
