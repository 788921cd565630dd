"""A measured robot, and commands on robots that are not as their files."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np

from coupling.files.robot_file import find_robot, load_robot
from coupling.identification.static.measurements import rms
from coupling.results.identified_result import IdentifiedResult
from docs.scripts.make_identify import identified, measurements
from docs.scripts.page_table import PageTable
from docs.scripts.runs import compensated, example, replays
from docs.scripts.trust_comparison import Against, Comparison, commanded

# What a fit of some forty loads leaves open of a joint's stiffness, as the page shows.
SOFTER = 0.8


@dataclass(frozen=True)
class Fanuc:
    """What 43 measured deflections of a FANUC R-2000iC say of the model.

    Attributes:
        joints, tilt: Leave-one-out error of six joints, and of them and a tilt of joint 3.
        worst: The row predicted worst, with the tilt [mm].
        narrowest, widest: Half width of a 95 % interval over its value, of what is identified [%].
    """

    joints: Comparison
    tilt: Comparison
    worst: float
    narrowest: float
    widest: float

    @classmethod
    def measured(cls) -> Fanuc:
        """Fit the model to the measurements."""
        axial, tilted = identified(), identified("supported")
        widths = [
            50.0 * (parameter.bounds[1] - parameter.bounds[0]) / parameter.value
            for parameter in tilted.parameters
            if parameter.identified and parameter.bounds and parameter.value
        ]
        return cls(
            _left_out("deflection of a real robot, joints", axial),
            _left_out("deflection of a real robot, joints and a tilt", tilted),
            1e3 * float(np.linalg.norm(tilted.displacements("left_out_error"), axis=1).max()),
            min(widths),
            max(widths),
        )


def _left_out(what: str, found: IdentifiedResult) -> Comparison:
    error, data = rms(found.displacements("left_out_error")), rms(measurements().deflection)
    words = f"{1e3 * error:.2f} of {1e3 * data:.2f} mm"
    return Comparison(what, Against.MEASUREMENT, error, data, words)


@cache
def left() -> dict[str, Comparison]:
    """Return what the cone's command leaves on its robot, as its validation says, and on others."""
    run = compensated(example("cone", plant={"stiffness_factor": SOFTER}))
    most = {name: deviation.maximum for name, deviation in replays(run).items()}
    entries = {
        "as_file": ("as its file", run.deviation(run.correction.achieved).maximum),
        "stiffness": (
            "off by 2 % of stiffness",
            max(most["stiffness +2 %"], most["stiffness -2 %"]),
        ),
        "force": ("off by 5 % of force", most["force +5 %"]),
        "backlash": (
            "off by 20 % of backlash",
            max(most["backlash +20 %"], most["backlash -20 %"]),
        ),
        "softer": ("20 % softer", most["plant"]),
    }
    robots = {name: (f"robot {what}", value) for name, (what, value) in entries.items()}
    return commanded(robots, run.deviation(run.before).maximum, "as_file")


def sampled() -> float:
    """Return what 90 % of sampled robots stay below, as the study's page has it [um]."""
    return PageTable.of("study", "cone").number("max", "90 % below")


def stiffer() -> tuple[float, float]:
    """Return how many times as stiff as the FANUC's joints 1 to 3 the example's are, from and to."""
    ours, theirs = (
        [joint.stiffness for joint in load_robot(find_robot(name)).joints[:3]]
        for name in ("icme2008", "fanuc_r2000ic")
    )
    ratios = np.array(ours, dtype=float) / np.array(theirs, dtype=float)
    return float(ratios.min()), float(ratios.max())
