"""A Python process beside this one in which an FMU runs, which may crash its host.

The process runs `coupling.fmu.worker_main`.  Both sides speak pickles over its standard streams:
("ready", names of the variables) or ("error", text) out; then jobs in, or the folder of another FMU,
and for each of them any number of ("progress", done, total) and one ("result", value) or ("error", text)
out.  Whatever keeps an FMU, the process ends with this one: at the end of its standard input it ends
itself and all that it started.
"""

from __future__ import annotations

import contextlib
import math
import os
import pickle
import queue
import signal
import subprocess
import sys
import tempfile
import threading
import time
import uuid
import zipfile
import zlib
from pathlib import Path
from typing import Any, BinaryIO

from coupling.child_processes import ProcessTree, marked_environment
from coupling.fmu.job import FmuError, Progress, SimulationJob, StepWindow
from coupling.native.compiler import host_platform
from coupling.native.desk_library import desk_library

# Of what an FMU has said before its end, which may be more than memory holds [bytes].
_LAST_WORDS = 2000
# Between two looks at a worker that does not answer [s].
_LOOK = 0.2

Answer = tuple[Any, ...]


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
        time_limit: Time from now after which no answer is awaited any more [s].

    Attributes:
        variables: Names of the FMU's variables.

    Raises:
        FmuError: If the FMU cannot be loaded in this time.
        CompilerError: If the desk library is neither shipped nor can be compiled here.
    """

    def __init__(self, folder: Path, time_limit: float = math.inf) -> None:
        one_thread = {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1", "MKL_NUM_THREADS": "1"}
        self._folder = folder
        self._time_limit, self._end = time_limit, time.monotonic() + time_limit
        mark = uuid.uuid4().hex
        self._said = tempfile.TemporaryFile()  # noqa: SIM115  (closed by close)
        self._process = subprocess.Popen(
            # Without -P a random.py of the user in the working folder would be imported.
            [
                *(sys.executable, "-P", "-m", f"{__package__}.worker_main"),
                *(str(folder), str(desk_library(host_platform()))),
            ],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=self._said,
            env={**marked_environment(mark), **one_thread},
        )
        self._started = ProcessTree(self._process.pid, mark)
        # Read by a thread: what an FMU has started may keep the stream open when the worker has ended.
        self._answers: queue.SimpleQueue[Answer | None] = queue.SimpleQueue()
        threading.Thread(
            target=_read_answers, args=(self._process.stdout, self._answers), daemon=True
        ).start()
        try:
            kind, content = self._answer()
            if kind == "error":
                raise FmuError(content)
            self.variables: frozenset[str] = content
        except FmuError:
            self.close()
            raise

    def close(self) -> None:
        """End the process and all that the FMU has started."""
        self._started.kill()
        self._process.kill()
        self._process.wait()
        assert self._process.stdin is not None
        with contextlib.suppress(OSError):
            self._process.stdin.close()
        self._said.close()

    def run_fmu(self, folder: Path) -> None:
        """Have the worker run the FMU in a folder from now on; none of its FMUs may be in Python.

        Raises:
            FmuError: If it cannot be loaded.
        """
        if folder != self._folder:
            self.send(folder)
            self.variables = frozenset(self.receive(lambda *_: None))
            self._folder = folder

    def send(self, job: SimulationJob | StepWindow | Path) -> None:
        """Give the worker a job."""
        assert self._process.stdin is not None
        try:
            pickle.dump(job, self._process.stdin)
            self._process.stdin.flush()
        except OSError as cause:
            raise self._death() from cause

    def receive(self, progress: Progress) -> Any:
        """Return the outputs of the job sent last, any unit, (n, job.width)."""
        while True:
            kind, *content = self._answer()
            if kind == "result":
                return content[0]
            if kind == "error":
                raise FmuError(content[0])
            progress(*content)

    def _answer(self) -> Answer:
        has_ended = False
        while True:
            wait = min(_LOOK, max(self._end - time.monotonic(), 0.0))
            try:
                answer = self._answers.get(timeout=wait)
            except queue.Empty:
                if has_ended:  # and its last answer was read
                    raise self._death() from None
                has_ended = self._process.poll() is not None
                if time.monotonic() >= self._end:
                    raise FmuError(
                        f"has not answered within the time limit of {self._time_limit:g} s and was"
                        " ended: see whether it hangs, or raise time_limit_s"
                    ) from None
                continue
            if answer is None:
                raise self._death()
            return answer

    def _death(self) -> WorkerEndedError:
        self._said.seek(max(self._said.seek(0, os.SEEK_END) - _LAST_WORDS, 0))
        lines = self._said.read().decode(errors="replace").strip().splitlines()
        last = f": {lines[-1]}" if lines else ""
        return WorkerEndedError(f"the process that runs the FMU has ended{self._status()}{last}")

    def _status(self) -> str:
        """Return in words how the process has ended, "" where it has ended by its own code."""
        status = None
        with contextlib.suppress(subprocess.TimeoutExpired):
            status = self._process.wait(_LOOK)
        if status is None or status == 0:
            return ""
        if status > 0 or -status not in signal.valid_signals():
            return f" with exit status {status}"
        return f" by {signal.Signals(-status).name}"


class WorkerProcesses:
    """Processes in which FMUs run, each one FMU at a time; started when they are first asked for.

    Attributes:
        started: Those that were started.
    """

    def __init__(self) -> None:
        self.started: list[WorkerProcess] = []

    def running(self, folder: Path, count: int) -> list[WorkerProcess]:
        """Return processes that run the unpacked FMU in a folder.

        Raises:
            FmuError: If the FMU cannot be loaded.
        """
        for process in self.started[:count]:
            process.run_fmu(folder)
        while len(self.started) < count:
            self.started.append(WorkerProcess(folder))
        return self.started[:count]

    def end(self) -> None:
        """End them; others are started when they are asked for."""
        while self.started:
            self.started.pop().close()


def _read_answers(stream: BinaryIO, answers: queue.SimpleQueue[Answer | None]) -> None:
    """Queue what a worker answers, and None at the end of its answers."""
    with stream:
        try:
            while True:
                answers.put(pickle.load(stream))
        except Exception:  # its end, or whatever an FMU has written between the answers
            answers.put(None)
