"""A process that is tried again where it fails: a licence that was taken, a node that was lost."""

from __future__ import annotations

from dataclasses import dataclass

from coupling.errors import ProcessError
from coupling.events import WarningEvent, Watch, unwatched
from coupling.path.histories import ToolPath
from coupling.process.base import Process, ProcessResponse, ProcessWrapper


@dataclass(frozen=True)
class RetriedProcess(ProcessWrapper):
    """A process and how often an evaluation of it is tried.

    Attributes:
        process: The process.
        tries: Tries of one evaluation at most, >= 1.
        watch: Function called with every try that fails.
    """

    process: Process
    tries: int
    watch: Watch = unwatched

    def evaluate(self, path: ToolPath) -> ProcessResponse:
        """Return the process's answer to a path, of the first try that has one.

        Raises:
            ProcessError: Of the last try, with the number of tries, if all of them fail.
        """
        for number in range(1, self.tries):
            try:
                return self.process.evaluate(path)
            except ProcessError as cause:
                self.watch(
                    WarningEvent(f"try {number} of {self.tries} failed, the next begins: {cause}")
                )
        try:
            return self.process.evaluate(path)
        except ProcessError as cause:
            if self.tries == 1:
                raise
            raise ProcessError(f"all {self.tries} tries failed, the last one: {cause}") from cause
