"""Parts of a run's deviation where its process is periodic."""

from __future__ import annotations

from coupling.path.deviation_parts import DeviationParts
from coupling.run.execute import Run


def tooth_passing_parts(run: Run) -> list[DeviationParts] | None:
    """Return the parts of every tool's deviation after a run; None where its process is not periodic.

    Neither are there any where the period is longer than the path.
    """
    correction = run.correction
    time, period = correction.desired.time, correction.response.period
    if period is None or period > time[-1] - time[0]:
        return None
    deviation = correction.achieved.position - correction.desired.position
    return [DeviationParts.of(time, tool_deviation, period) for tool_deviation in deviation]
