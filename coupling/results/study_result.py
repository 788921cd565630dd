"""Samples of a study, and study.json, what they say."""

from __future__ import annotations

import json
import zlib
from typing import Annotated, Literal

from pydantic import Field

from coupling.path.deviation import Deviation
from coupling.results.base import ResultFile, ResultPart
from coupling.results.expected_deviation import ExpectedDeviation


class StudySample(ResultPart):
    """What the command leaves on one sampled robot.

    Attributes:
        deviation: Deviation from the desired paths, the worst figures of all tools; None where the
            robot cannot be simulated.
        distance: Largest distance from them in each part of the path [m]; empty there.
        failure: Reason why it cannot be simulated, or empty.
        converged: Whether robot and process came together; true where the process was not evaluated.
    """

    number: int
    deviation: Deviation | None
    distance: tuple[float, ...]
    failure: str = ""
    evaluations: int = 0
    converged: bool = True

    def line(self) -> bytes:
        """Return its line of the table; numbers survive exactly."""
        text = json.dumps(self.model_dump(), separators=(",", ":")).encode()
        return b"%08x %s\n" % (zlib.crc32(text), text)

    @classmethod
    def of_line(cls, line: bytes) -> StudySample:
        """Return the sample of a line."""
        crc, _, text = line.partition(b" ")
        if not text.endswith(b"\n") or int(crc, 16) != zlib.crc32(text[:-1]):
            raise ValueError("the line does not agree with its checksum")
        return cls.model_validate_json(text, strict=True)


class StudyCommandResult(ResultPart):
    """What the command leaves on the dynamic model."""

    converged: bool
    reason: str
    deviation_m: Deviation


class ShareResult(ResultPart):
    """Significance of one parameter for a deviation.

    Attributes:
        share: Share of the deviation's variance that goes back to this parameter alone, its first-order
            Sobol index: 0 to 1.
        rank_correlation: Spearman's, -1 to 1: whether the deviation rises with the parameter.
    """

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


class StudySource(ResultPart):
    """Case file, robot file and run folder of a study, as commands name them."""

    case: str
    robot: str
    run: str


class StudyResult(ResultFile):
    """Figures of a study; docs/study.md says what they are.

    `chosen` says whether the case varies its parameters on purpose; else robots are those to expect.
    """

    what = "the figures of a study"

    case: str
    source: StudySource
    tolerance_m: float | None = None
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
    chosen: bool
    expected: ExpectedDeviation | None
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
        pairs = [
            (parameter, {"maximum": parameter.influence.maximum, "rms": parameter.influence.rms})
            for parameter in self.parameters
            if parameter.influence.maximum is not None and parameter.influence.rms is not None
        ]
        return sorted(pairs, key=lambda entry: -entry[1]["maximum"].share)
