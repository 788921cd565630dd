"""What commands leave on robots that differ, as replays tell it."""

from coupling.path.deviation import Deviation
from coupling.results.outlook import WorstReplay
from coupling.results.replay import Replay


def deviation(maximum: float, less_constant: float) -> Deviation:
    return Deviation(
        maximum=maximum,
        rms=0.5 * maximum,
        normal_maximum=maximum,
        tangential_maximum=0.0,
        time_of_maximum=1.0,
        maximum_less_constant=less_constant,
        rms_less_constant=0.5 * less_constant,
    )


def outlook(*rows: tuple[str, float, float]) -> WorstReplay:
    replays = [Replay(name=name, deviation=deviation(*own)) for name, *own in rows]
    found = WorstReplay.among(deviation(1.7e-3, 4e-4), replays)
    assert found is not None
    return found
