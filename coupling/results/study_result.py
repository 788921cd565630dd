"""study.json, what the samples of a study say."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from coupling.path.deviation import Deviation
from coupling.results.result_file import ResultFile, ResultPart


class StudyCommandResult(ResultPart):
    """What the command leaves on the dynamic model."""

    converged: bool
    reason: str
    deviation_m: Deviation


class ShareResult(ResultPart):
    """Share of a parameter in the variance of a deviation."""

    share: float
    rank_correlation: float


class InfluenceResult(ResultPart):
    """Shares of a parameter; None of too few samples."""

    maximum: ShareResult | None
    rms: ShareResult | None


class UncertainResult(ResultPart):
    """An uncertain parameter."""

    name: str
    distribution: str
    range: tuple[float, float]
    influence: InfluenceResult


class StudyResult(ResultFile):
    """Figures of a study; docs/study.md says what they are."""

    what = "the figures of a study"

    case: str
    kind: Literal["study"]
    samples: int
    design: str
    seed: int
    coverage: float
    wrench: Literal["model", "coupled"]
    process_evaluations: int
    not_coupled: tuple[int, ...]
    failed: dict[str, str]
    command: StudyCommandResult
    quantiles_m: dict[str, dict[str, float]]
    parameters: Annotated[tuple[UncertainResult, ...], Field(min_length=1)]
    silent: tuple[str, ...]
    fmu_fingerprint: str
    versions: dict[str, str]

    def quantile(self, name: str, share: float) -> float:
        """Return the deviation [m] by its name below which a share of robots stays."""
        return self.quantiles_m[name][f"{share:g}"]

    @property
    def ordered(self) -> list[tuple[UncertainResult, dict[str, ShareResult]]]:
        """Parameters with shares of "maximum" and "rms", the largest first; none of too few samples."""
        told = [
            (own, {"maximum": own.influence.maximum, "rms": own.influence.rms})
            for own in self.parameters
            if own.influence.maximum is not None and own.influence.rms is not None
        ]
        return sorted(told, key=lambda entry: -entry[1]["maximum"].share)
