"""What a command leaves on robots that differ from the model, beside what is left uncorrected."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from math import isnan
from typing import Annotated

from pydantic import Field, PrivateAttr

from coupling.path.deviation import Deviation, measure_tools, worst_of
from coupling.path.histories import ToolPath
from coupling.path.length_text import in_unit, length_unit
from coupling.results.base import ResultPart
from coupling.results.section import Table

# First word of the replays whose backlash differs.
BACKLASH = "backlash"
# A command that leaves no more than this factor of what is uncorrected is as good: a verdict must not
# turn on less than the choice of what is varied does.
_AS_GOOD = 1.05


class Replay(ResultPart):
    """What a command leaves on robots that differ from the model.

    Attributes:
        name: Difference from the model, in words.
        deviation: Deviation from the desired paths, the worst figures of all tools.
        uncorrected: The same under the uncorrected command, on the same robots; None where it is not
            known.
    """

    sparse = ("uncorrected_m",)

    name: str
    deviation: Annotated[Deviation, Field(alias="deviation_m")]
    uncorrected: Annotated[Deviation | None, Field(alias="uncorrected_m")] = None
    _tools: tuple[Deviation, ...] = PrivateAttr(())
    _path: ToolPath | None = PrivateAttr(None)

    @classmethod
    def of(cls, name: str, path: ToolPath, desired: ToolPath) -> Replay:
        """Return what a path of all tools leaves to the desired one."""
        tools = measure_tools(path, desired)
        replay = cls(name=name, deviation=worst_of(tools))
        replay._tools = tools
        return replay

    def beside(self, uncorrected: Deviation) -> Replay:
        """Return it with what the uncorrected command leaves on the same robots."""
        return self.model_copy(update={"uncorrected": uncorrected})

    def keeping(self, path: ToolPath) -> Replay:
        """Return it with the path of all tools."""
        replay = self.model_copy()
        replay._path = path
        return replay

    def without_path(self) -> Replay:
        """Return it without the path, which takes memory."""
        replay = self.model_copy()
        replay._path = None
        return replay

    @property
    def path(self) -> ToolPath | None:
        """Path of all tools, where it was kept."""
        return self._path

    def of_tool(self, tool: int) -> Replay:
        """Return what the command leaves of one tool, by its number from 0."""
        return Replay(name=self.name, deviation=self._tools[tool])


def keeping_the_worst(replays: Iterable[Replay]) -> list[Replay]:
    """Return replays of which none but the one with the largest deviation keeps its path."""
    results: list[Replay] = []
    worst: int | None = None
    for number, replay in enumerate(replays):
        if worst is None or replay.deviation.maximum > results[worst].deviation.maximum:
            if worst is not None:
                results[worst] = results[worst].without_path()
            worst = number
            results.append(replay)
        else:
            results.append(replay.without_path())
    return results


def worst_backlash(replays: Sequence[Replay]) -> Replay | None:
    """Return the worst of the replays whose backlash differs from the model's; None without."""
    wrong = [replay for replay in replays if replay.name.startswith(BACKLASH)]
    return max(wrong, key=lambda replay: replay.deviation.maximum, default=None)


class Worsening(ResultPart):
    """A robot on which a command leaves more than the uncorrected one.

    Attributes:
        name: Its difference from the model, in words.
        deviation: Largest deviation under the command [m].
        uncorrected: The same under the uncorrected command [m].
        is_shifted: Whether both are less a constant, what remains after a shift of the part.
    """

    name: str
    deviation: float
    uncorrected: float
    is_shifted: bool

    @classmethod
    def of(cls, replay: Replay, before: Deviation, is_shifted: bool) -> Worsening:
        """Return both deviations on the robots of a replay, be they worse or not.

        Args:
            before: Deviation of the uncorrected command on the model, for a replay that does not know it
                on its own robots.
        """
        pair = (replay.deviation, replay.uncorrected or before)
        if is_shifted:
            deviation, uncorrected = (figures.maximum_less_constant for figures in pair)
        else:
            deviation, uncorrected = (figures.maximum for figures in pair)
        return cls(
            name=replay.name,
            deviation=deviation,
            uncorrected=uncorrected,
            is_shifted=is_shifted,
        )

    @classmethod
    def worst(
        cls,
        singles: Sequence[Replay],
        samples: Sequence[Sequence[Replay]],
        before: Deviation,
        is_shifted: bool,
        share: float = 0.5,
    ) -> Worsening | None:
        """Return the worst one to be expected; None where the command is no worse than none.

        Args:
            singles: Replays on robots that are to be expected each.
            samples: Replays on robots that are drawn.
            share: Share of each sample up to which a robot is to be expected.
        """
        pairs = [cls.of(replay, before, is_shifted) for replay in singles]
        for sample in filter(None, samples):
            number = cls.deciding(sample, before, is_shifted, share)
            pairs.append(cls.of(sample[number], before, is_shifted))
        worst = max(pairs, key=lambda pair: pair.excess, default=None)
        return None if worst is None or worst.excess <= 0.0 else worst

    @classmethod
    def deciding(
        cls, sample: Sequence[Replay], before: Deviation, is_shifted: bool, share: float
    ) -> int:
        """Return the number of the replay that stands for a sample: the worst of a share of all.

        Args:
            sample: Replays on robots that are drawn, at least one.
            before: As of `of`.
            share: Share of the sample up to which a robot is to be expected.
        """
        excess = [cls.of(replay, before, is_shifted).excess for replay in sample]
        order = sorted(range(len(sample)), key=excess.__getitem__)
        return order[max(int(share * len(sample) + 0.5), 1) - 1]

    @property
    def excess(self) -> float:
        """Deviation by which the command is worse beyond doubt [m]; negative where it is not."""
        return self.deviation - _AS_GOOD * self.uncorrected


def deviation_table(rows: Iterable[tuple[str, Deviation]]) -> Table:
    """Return a table of deviations by their names."""
    rows = list(rows)
    _, unit = length_unit(*(deviation.maximum for _, deviation in rows))
    return Table(
        (
            f"deviation [{unit}]",
            "max",
            "rms",
            "max across travel",
            "at t = [s]",
            "max less a constant",
            "rms less a constant",
        ),
        [
            (
                name,
                *(
                    in_unit(length, unit)
                    for length in (deviation.maximum, deviation.rms, deviation.normal_maximum)
                ),
                f"{deviation.time_of_maximum:.3f}",
                *(less_constant(deviation, unit) or ("-", "-"))[:2],
            )
            for name, deviation in rows
        ],
    )


def less_constant(deviation: Deviation | None, unit: str) -> tuple[str, ...] | None:
    """Return max and rms of a deviation less a constant, in a unit of lengths; None in an older run."""
    if deviation is None or isnan(deviation.maximum_less_constant):
        return None
    return (
        in_unit(deviation.maximum_less_constant, unit),
        in_unit(deviation.rms_less_constant, unit),
        "",
    )
