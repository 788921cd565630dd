"""The program that a `coupling.fmu.worker` runs: python -m coupling.fmu.worker_main FOLDER."""

from __future__ import annotations

import contextlib
import io
import os
import pickle
import sys
from pathlib import Path
from typing import BinaryIO

from coupling.fmu.driver import load
from coupling.fmu.job import FmuError


def serve(folder: Path, jobs: BinaryIO, answers: BinaryIO) -> None:
    """Answer jobs on the FMU in a folder until there are no more."""

    def send(*answer: object) -> None:
        pickle.dump(answer, answers)
        answers.flush()

    try:
        driver = load(folder)
    except FmuError as error:
        send("error", str(error))
        return
    send("ready", driver.variables)
    while True:
        try:
            job = pickle.load(jobs)
        except EOFError:
            return
        answer: tuple[str, object]
        said = io.StringIO()  # an FMU gives the reason of an error on stderr only
        with contextlib.redirect_stderr(said):
            try:
                answer = ("result", driver.run(job, lambda *steps: send("progress", *steps)))
            except FmuError as error:
                reason = said.getvalue().strip().splitlines()
                answer = ("error", reason[-1] if reason else str(error))
        send(*answer)


if __name__ == "__main__":
    # Whatever else prints to stdout must not come between the answers.
    answers = os.fdopen(os.dup(sys.stdout.fileno()), "wb")
    os.dup2(sys.stderr.fileno(), sys.stdout.fileno())
    with contextlib.suppress(BrokenPipeError, KeyboardInterrupt):
        serve(Path(sys.argv[1]), sys.stdin.buffer, answers)
    os._exit(0)  # past the destructors of PythonFMU's binary, which may crash
