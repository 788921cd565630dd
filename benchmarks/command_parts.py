"""Run one command of a checkout and print the CPU seconds of its parts as JSON.

    python benchmarks/command_parts.py CHECKOUT check my_case.toml

Imports nothing of the project but from that checkout, which may be an earlier one: what it does not have
takes no time.
"""

from __future__ import annotations

import builtins
import functools
import json
import os
import sys
import time
from collections.abc import Callable
from contextlib import redirect_stdout, suppress
from typing import Any

# Functions and methods, by their modules, and the parts that they are.
PARTS = {
    "coupling.robot.inverter": {"Inverter.invert": "inverse"},
    "coupling.robot.inverse_kinematics": {"InverseKinematics.plan": "inverse kinematics"},
    "coupling.inverse.diagnosis": {"diagnose": "gears", "diagnosed": "gears"},
    "coupling.run.exact_command": {"exact_command": "inverse"},
    "coupling.store.evaluated_process": {"EvaluatedProcess.evaluate": "process"},
    "coupling.run.expected_robots": {"drawn_replays": "drawn robots"},
    "coupling.identification.runs.fit": {"fit_runs": "fit"},
    "coupling.place.screen": {"Screen.figures": "screen"},
    "coupling.place.coarse_screen": {"CoarseScreen.figures": "screen"},
    "coupling.files.csv_table": {"write_table": "tables", "read_table": "tables"},
    "coupling.report.result_report": {"ResultReport.write": "page"},
    "coupling.fmu_export.build": {"build_fmu": "FMU"},
}
_NOT_CONVERGED = 1
START, SIMULATIONS, REST = "start", "other processes", "rest"


class PartTimes:
    """CPU time of parts of this process; one within another counts for itself alone.

    Attributes:
        spent: Times by parts [s].
    """

    def __init__(self) -> None:
        self.spent: dict[str, float] = {}
        self._open = [START]
        self._since = 0.0

    def timed(self, part: str, function: Callable[..., Any]) -> Callable[..., Any]:
        """Return the function, timed as a part."""

        @functools.wraps(function)
        def run(*values: Any, **named: Any) -> Any:
            self._settle()
            self._open.append(part)
            try:
                return function(*values, **named)
            finally:
                self._settle()
                self._open.pop()

        return run

    def _settle(self) -> None:
        now, part = time.process_time(), self._open[-1]
        self.spent[part] = self.spent.get(part, 0.0) + now - self._since
        self._since = now


def run_command(checkout: str, words: list[str]) -> dict[str, float]:
    """Run a command and return the CPU seconds of its parts.

    Raises:
        SystemExit: If it refuses its input.
    """
    sys.path[:1] = [checkout, os.path.join(checkout, "fmu_src")]
    times, importing, unseen = PartTimes(), builtins.__import__, set(PARTS)
    first_import = times.timed(START, importing)

    def imported(name: str, *values: Any, **named: Any) -> Any:
        result = (importing if name in sys.modules else first_import)(name, *values, **named)
        # Before the names of the module are taken from it.
        if name in unseen:
            unseen.remove(name)
            _time_parts(times, name)
        return result

    builtins.__import__ = imported
    from coupling.cli.main import main

    with redirect_stdout(sys.stderr):
        try:
            times.timed(REST, main)(words)
        except SystemExit as end:
            if end.code not in (0, _NOT_CONVERGED):
                raise
    of_others = os.times()
    return times.spent | {SIMULATIONS: of_others.children_user + of_others.children_system}


def _time_parts(times: PartTimes, module: str) -> None:
    for name, part in PARTS[module].items():
        *holders, last = name.split(".")
        with suppress(AttributeError):
            holder: Any = functools.reduce(getattr, holders, sys.modules[module])
            setattr(holder, last, times.timed(part, getattr(holder, last)))


if __name__ == "__main__":
    print(json.dumps(run_command(sys.argv[1], sys.argv[2:])))
