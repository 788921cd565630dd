"""How far a run's tools are off their paths, before and after, and by what."""

from __future__ import annotations

from dataclasses import dataclass

from coupling.path.deviation import Deviation, measure
from coupling.path.histories import ToolPath
from coupling.run.execute import Run


@dataclass(frozen=True)
class Deviations:
    """Deviations of one tool or the worst of several, in a run.

    Attributes:
        before: Deviation of the loaded tool from the desired path, command = desired path.
        after: Deviation of the achieved path from the desired one.
        gravity: Deviation of the unloaded tool from the desired path, command = desired path.
        process: Deviation of the loaded tool from the unloaded one, under the same command.
        gravity_after, process_after: The same under the corrected command: where the tool goes without
            the process, and by how much the process then moves it; None where that was not simulated.
        dynamic: Deviation of the path under the corrected command, simulated in dynamic mode, from the
            desired one; None where that was not run.
    """

    before: Deviation
    after: Deviation
    gravity: Deviation
    process: Deviation
    gravity_after: Deviation | None
    process_after: Deviation | None
    dynamic: Deviation | None

    @classmethod
    def of(cls, run: Run, tool: int | None = None) -> Deviations:
        """Return the deviations of one tool of a run, or the worst of all."""

        def own(path: ToolPath) -> ToolPath:
            return path if tool is None else path.tools[tool]

        found, desired = run.correction, own(run.desired)
        before, unloaded = own(run.before), own(found.unloaded)
        achieved = own(found.achieved)
        dry = None if run.unloaded_after is None else own(run.unloaded_after)
        return cls(
            before=measure(before, desired),
            after=measure(achieved, desired),
            gravity=measure(unloaded, desired),
            process=measure(before, unloaded),
            gravity_after=None if dry is None else measure(dry, desired),
            process_after=None if dry is None else measure(achieved, dry),
            dynamic=None if run.dynamic is None else measure(own(run.dynamic), desired),
        )
