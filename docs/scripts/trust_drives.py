"""What a command leaves on a robot that has drives: cone and ISO 9283 path of the examples, a KR 300.

Corrected for drives that are where their command is, run on the motors, servos and friction of its file;
corrected for those; and this on robots whose drives are not as the file says.
"""

from __future__ import annotations

from functools import cache
from typing import Any

from coupling.case.case import Case
from coupling.path.deviation import Deviation
from docs.scripts.page import table
from docs.scripts.runs import compensated, example, replays
from docs.scripts.trust_comparison import commanded, micrometres

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
    rows = {
        "ideal drives, not corrected": run.deviation(run.before),
        "ideal drives, corrected": run.deviation(run.correction.achieved),
        "that command on the servos": replays(run)["plant"],
    }
    run = compensated(real)
    rows |= {
        "servos, not corrected": run.deviation(run.before),
        "servos, corrected for them": run.deviation(run.correction.achieved),
    }
    return rows | {f"that command, {name}": replays(run)[name] for name in OTHERS}


def drives_table() -> str:
    """Return the page's table: what is left of both paths [um]."""
    found = {words: left(path) for path, words in PATHS.items()}
    names = next(iter(found.values()))
    lines = [
        (
            name,
            *(
                f"{micrometres(rows[name].maximum)} / {micrometres(rows[name].rms)}"
                for rows in found.values()
            ),
        )
        for name in names
    ]
    return table(("a KR 300, largest / rms deviation [um]", *found), lines)


def values() -> dict[str, Any]:
    """Return what the page says of it, by the names of its template."""
    most = {name: deviation.maximum for name, deviation in left("cone").items()}
    friction, gain = (
        max(most[f"that command, {name}"] for name in OTHERS if name.startswith(kind))
        for kind in ("friction", "servo gain")
    )
    entries = {
        "driven": ("robot with drives as its file", most["servos, corrected for them"]),
        "undriven": ("robot's drives ignored", most["that command on the servos"]),
        "rubbed": ("robot off by 30 % of friction", friction),
        "gained": ("robot off by 20 % of servos' gains", gain),
    }
    return {
        "drives": drives_table(),
        **commanded(entries, most["servos, not corrected"], "driven"),
    }
