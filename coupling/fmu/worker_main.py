"""A worker: python -m elastic_robot.coupling.fmu.worker_main FOLDER DESK_LIBRARY."""

from __future__ import annotations

import contextlib
import ctypes
import io
import os
import pickle
import queue
import sys
import threading
import traceback
from pathlib import Path
from typing import BinaryIO

import numpy as np

from coupling.child_processes import ProcessTree, inherited_mark
from coupling.fmu.driver import Driver, load
from coupling.fmu.job import FmuError, MarchJob, Progress, SimulationJob, StepWindow
from coupling.fmu.stepped import SteppedInstance

Job = SimulationJob | StepWindow | Path


class Server:
    """Answers jobs on the FMU that was loaded last.

    Args:
        folder: The first one's folder.
        library: The desk library.
    """

    def __init__(self, folder: Path, library: ctypes.CDLL) -> None:
        self._library, self._drivers = library, {folder: load(folder, library)}
        self._driver: Driver = self._drivers[folder]
        self._march: SteppedInstance | None = None

    @property
    def variables(self) -> frozenset[str]:
        """Names of the FMU's variables."""
        return self._driver.variables

    def answer(self, job: Job, progress: Progress) -> np.ndarray | frozenset[str]:
        """Return the outputs, any unit, (n, width), or the names of the variables of another FMU.

        Raises:
            FmuError: If the FMU refuses.
        """
        if isinstance(job, StepWindow):
            if self._march is None:
                raise FmuError("expected a simulation that goes on, got none: begin it anew")
            return self._march.run(job)
        if self._march is not None:
            self._march.close()
            self._march = None
        if isinstance(job, Path):
            if job not in self._drivers:
                self._drivers[job] = load(job, self._library)
            self._driver = self._drivers[job]
            return self.variables
        if not isinstance(job, MarchJob):
            return self._driver.run(job, progress)
        self._march = SteppedInstance(self._driver, job)
        return self._march.read()[None]


def receive(stream: BinaryIO, jobs: queue.SimpleQueue[Job]) -> None:
    """Queue jobs; at their end, as where the master was killed, end this process amid its work."""
    with contextlib.suppress(EOFError, OSError, pickle.UnpicklingError):
        while True:
            jobs.put(pickle.load(stream))
    try:
        ProcessTree(os.getpid(), inherited_mark()).kill()
    finally:
        os._exit(0)


def serve(folder: Path, library: Path, jobs: queue.SimpleQueue[Job], answers: BinaryIO) -> None:
    """Answer jobs on the FMU in a folder, whose steps the desk library takes."""

    def send(*answer: object) -> None:
        pickle.dump(answer, answers)
        answers.flush()

    try:
        server = Server(folder, ctypes.CDLL(str(library)))
    except FmuError as error:
        send("error", str(error))
        return
    send("ready", server.variables)
    while True:
        job = jobs.get()
        answer: tuple[str, object]
        said = io.StringIO()  # an FMU gives the reason of an error on stderr only
        with contextlib.redirect_stderr(said):
            try:
                answer = ("result", server.answer(job, lambda *steps: send("progress", *steps)))
            except FmuError as error:
                reason = said.getvalue().strip().splitlines()
                answer = ("error", reason[-1] if reason else str(error))
        send(*answer)


if __name__ == "__main__":
    # Whatever else prints to stdout must not come between the answers.
    answers = os.fdopen(os.dup(sys.stdout.fileno()), "wb")
    os.dup2(sys.stderr.fileno(), sys.stdout.fileno())
    jobs: queue.SimpleQueue[Job] = queue.SimpleQueue()
    # A thread, which runs while the FMU computes: calls into its library hold no lock of Python.
    threading.Thread(target=receive, args=(sys.stdin.buffer, jobs), daemon=True).start()
    try:
        serve(Path(sys.argv[1]), Path(sys.argv[2]), jobs, answers)
    except (BrokenPipeError, KeyboardInterrupt):
        pass
    except BaseException:
        traceback.print_exc()
    finally:
        sys.stderr.flush()
        os._exit(0)  # past the destructors of PythonFMU's binary, which may crash
