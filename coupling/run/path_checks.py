"""Paths of the tools under the same command in other conditions, and between each other."""

from __future__ import annotations

from dataclasses import dataclass

from coupling.case.case import Case
from coupling.path.deviation import ToolGap
from coupling.path.histories import ToolPath, WrenchHistory
from coupling.run.check import Check, CheckedCommand, of_corrections
from coupling.solve.correction import Correction
from elastic_robot.fmi.interface import Mode


@dataclass(frozen=True)
class OtherModePaths:
    """Paths of the robots simulated in the mode that is not the run's; None where that was not possible.

    Attributes:
        before, after: Paths under the commands and wrenches before and after compensation; after a
            coupling no path after.
    """

    before: ToolPath | None = None
    after: ToolPath | None = None


def other_mode(mode: Mode) -> Mode:
    """Return the mode that robots of a mode are compared with."""
    return "quasistatic" if mode == "dynamic" else "dynamic"


def _unloaded_paths(command: CheckedCommand) -> ToolPath | None:
    """Return the paths under the corrected command and gravity alone."""
    correction = command.correction
    none = WrenchHistory.none(correction.desired.time, len(correction.joints.q))
    return command.simulated(correction.joints, none, command.case.mode)


def _other_mode(command: CheckedCommand) -> OtherModePaths:
    correction, other = command.correction, other_mode(command.case.mode)
    first = correction.before
    before = command.simulated(first.joints, first.wrench, other)
    if command.kind == "couple":
        return OtherModePaths(before)
    after = command.simulated(correction.joints, correction.response.wrench, other)
    return OtherModePaths(before, after)


def tool_gap(case: Case, correction: Correction) -> ToolGap | None:
    """Return the gap between the tools of a cell."""
    support = case.task.support
    if support is None:
        return None
    before, after = support.opening(correction.before.path), support.opening(correction.achieved)
    return ToolGap(correction.desired.time, support.gap, before, after)


UNLOADED_PATHS = Check[ToolPath | None]("unloaded", _unloaded_paths, None, of_corrections)
OTHER_MODE = Check[OtherModePaths]("other_mode", _other_mode, OtherModePaths())
TOOL_GAP = Check[ToolGap | None](
    "gap", lambda command: tool_gap(command.case, command.correction), None
)
