"""What a command leaves on a robot that has drives: cone and ISO 9283 path of the examples, a KR 300.

Corrected for drives that are where their command is, run on the motors, servos and friction of its file;
corrected for those; and this on robots whose drives are not as the file says.
"""

from __future__ import annotations

from functools import cache
from typing import Any

from coupling.case.case import Case
from coupling.path.deviation import Deviation
from coupling.run.plant import PLANT_REPLAY
from docs.scripts.page import table
from docs.scripts.runs import compensated, example
from docs.scripts.trust_comparison import Against, Comparison

ROBOT = "kuka_kr300"
PATHS = {"cone": "the example cone", "iso9283": "ISO 9283 path"}
# Of what every run varies; Coulomb friction of recordings A and B differs by up to 45 % in a joint.
OTHERS = ("friction +30 %", "friction -30 %", "servo gain +20 %", "servo gain -20 %")


@cache
def left(path: str) -> dict[str, Deviation]:
    """Return what commands of the KR 300 leave along a path of the examples, by what was done."""
    ideal, real = {"description": ROBOT, "drive": "ideal"}, {"description": ROBOT, "drive": "servo"}
    plant = {"drive": "servo", "couple": True}
    return left_in(example(path, robot=ideal, plant=plant), example(path, robot=real))


def left_in(ideal: Case, real: Case) -> dict[str, Deviation]:
    """Return what commands leave, by what was done.

    Args:
        ideal: A case of ideal drives whose plant has servos.
        real: The same with servos.
    """
    run = compensated(ideal)
    plant = run.of(PLANT_REPLAY)
    assert plant is not None
    rows = {
        "ideal drives, not corrected": run.deviation(run.before),
        "ideal drives, corrected": run.deviation(run.correction.achieved),
        "that command on the servos": plant.deviation(),
    }
    run = compensated(real)
    replays = {replay.name: replay.deviation for replay in run.robustness}
    rows |= {
        "servos, not corrected": run.deviation(run.before),
        "servos, corrected for them": run.deviation(run.correction.achieved),
    }
    return rows | {f"that command, {name}": replays[name] for name in OTHERS}


def drives_table() -> str:
    """Return the page's table: what is left of both paths [um]."""
    found = {words: left(path) for path, words in PATHS.items()}
    names = next(iter(found.values()))
    lines = [
        (name, *(f"{_um(rows[name].maximum)} / {_um(rows[name].rms)}" for rows in found.values()))
        for name in names
    ]
    return table(("a KR 300, largest / rms deviation [um]", *found), lines)


def values() -> dict[str, Any]:
    """Return what the page says of it, by the names of its template."""
    most = {name: deviation.maximum for name, deviation in left("cone").items()}
    before = most["servos, not corrected"]
    entries = {
        "driven": ("robot with drives as its file", most["servos, corrected for them"]),
        "undriven": ("robot's drives ignored", most["that command on the servos"]),
        "rubbed": (
            "robot off by 30 % of friction",
            max(most["that command, friction +30 %"], most["that command, friction -30 %"]),
        ),
        "gained": (
            "robot off by 20 % of servos' gains",
            max(most["that command, servo gain +20 %"], most["that command, servo gain -20 %"]),
        ),
    }
    return {
        "drives": drives_table(),
        **{
            key: Comparison(
                f"command, {what}",
                Against.PROGRAM if key == "driven" else Against.ROBOT,
                value,
                before,
                f"{_um(value)} of {_um(before)} um",
            )
            for key, (what, value) in entries.items()
        },
    }


def _um(metres: float) -> str:
    """Return a length in words [um]."""
    return f"{1e6 * metres:{'.1g' if metres < 5e-8 else '.2g' if metres < 1e-5 else '.0f'}}"
