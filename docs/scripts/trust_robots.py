"""A measured robot, and commands on robots that are not as their files."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np

from coupling.files.robot_file import find_robot, load_robot
from coupling.identification.static.measurements import rms
from coupling.identification.static.verdicts import Identification
from coupling.run.execute import Run
from coupling.run.plant import PLANT_REPLAY
from docs.scripts.make_identify import identified, measurements
from docs.scripts.page_table import PageTable
from docs.scripts.runs import compensated, example
from docs.scripts.trust_comparison import Against, Comparison

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
            1e3 * float(np.linalg.norm(tilted.left_out, axis=1).max()),
            min(widths),
            max(widths),
        )


def _left_out(what: str, found: Identification) -> Comparison:
    error, data = rms(found.left_out), rms(measurements().deflection)
    words = f"{1e3 * error:.2f} of {1e3 * data:.2f} mm"
    return Comparison(what, Against.MEASUREMENT, error, data, words)


@cache
def _cone() -> Run:
    return compensated(example("cone", plant={"stiffness_factor": SOFTER}))


def commanded() -> dict[str, Comparison]:
    """Return what the cone's command leaves on its robot and on others, beside what was before.

    On its robot: as the validation's own simulation has it.
    """
    run = _cone()
    replays = {replay.name: replay.deviation.maximum for replay in run.robustness}
    plant = run.of(PLANT_REPLAY)
    assert plant is not None
    left = {
        "as_file": ("as its file", run.deviation(run.correction.achieved).maximum),
        "stiffness": (
            "off by 2 % of stiffness",
            max(replays["stiffness +2 %"], replays["stiffness -2 %"]),
        ),
        "force": ("off by 5 % of force", replays["force +5 %"]),
        "backlash": (
            "off by 20 % of backlash",
            max(replays["backlash +20 %"], replays["backlash -20 %"]),
        ),
        "softer": ("20 % softer", plant.deviation().maximum),
    }
    before = run.deviation(run.before).maximum
    return {
        name: Comparison(
            f"command, robot {what}",
            Against.PROGRAM if name == "as_file" else Against.ROBOT,
            value,
            before,
            f"{1e6 * value:{'.2g' if value < 1e-5 else '.0f'}} of {1e6 * before:.0f} um",
        )
        for name, (what, value) in left.items()
    }


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
