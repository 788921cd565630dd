"""Write docs/trust.md, its pictures and the README's summary of it: make trust, some five minutes.

The FMUs, MuJoCo, CalculiX (where it is installed), the measured robot and the cone on other robots are
run anew; what `make measured-sheet` and `make study` take long for is read from their pages.
"""

from __future__ import annotations

import sys
from typing import Any

import numpy as np

from docs.scripts import trust_breakthrough as breakthrough
from docs.scripts import trust_drives as drives
from docs.scripts import trust_engines as engines
from docs.scripts import trust_figures as figures
from docs.scripts import trust_motion as motion
from docs.scripts import trust_recordings as recordings
from docs.scripts import trust_robots as robots
from docs.scripts import trust_sheet as sheet
from docs.scripts.make_identify import identified
from docs.scripts.page import fill, finish, replace
from docs.scripts.page_table import PageTable
from docs.scripts.pictures import save
from docs.scripts.trust_comparison import Comparison

SUMMARY = """\
- **The equations are solved.** Against MuJoCo and a second engine the built FMUs deviate by at most
  {rest.words} at rest and {path_backlash.words} in 22.8 s of motion with backlash.
- **A real robot at rest: {tilt.verdict}.** Springs and a tilt identified from 43 measured deflections
  predict further ones to {tilt.words}.
- **A real robot in motion: rough at best.** Without any fit, the surge of a FANUC as a drill breaks
  through is predicted with an error of {surge.words}; the motor torques of a recorded KUKA, with
  the friction of another recording, with errors of {torque.words}. Identified from
  one motion, the KUKA's torques in another are predicted to {torque_fitted.words}, its motors
  less its links to {link.words}; a lag alone, without a robot, leaves {link_by_lag.words}.
- **Forming forces: measure one.**
  On a measured sheet `sheet-fem` is off by {axial.beyond}, Aerens' law by {law.beyond}.
- **A command is as accurate as its robot file.**
  Of the example cone's {before:.0f} um it leaves {as_file_um:.2f} um if the file is right,
  {backlash_um:.0f} um with 20 % more or less backlash, {softer_um:.0f} um with joints 20 % softer.
  On a KUKA with servos and friction it leaves {driven.words} if they are as in the file,
  {undriven.words} if they are ignored, {rubbed.words} with 30 % more or less friction.
- **Never compared:** the path of a real robot's tool, hysteresis of its gears, heat, its controller; a
  part made by a command of this project."""


def published() -> dict[str, Any]:
    """Return what other pages tell: values of the template by name."""
    thin, shape = sheet.thinning(), sheet.shape()
    thickness = PageTable.of("measured_sheet", "shape").number("smallest thickness", "measured")
    given = sheet.benchmark()
    sine = 1e3 * given.thickness * np.cos(given.angle)
    bharti = PageTable.of("measured_sheet", "law").cell("cone of [Bharti2024]", "Aerens' law")
    return {
        "axial": sheet.steady_force(),
        "solid": sheet.steady_force_of_solids(),
        "law": sheet.force_law(),
        "thin": thin,
        "shape": shape,
        "sine": sine,
        "sine_off": sine - thickness,
        "shape_percent": 0.1 * shape.deviation / given.depth,
        "commanded": shape.of,
        "bharti": bharti,
        "sampled": robots.sampled(),
    }


def computed() -> dict[str, Any]:
    """Return what is computed anew: values of the template by name."""
    plunge, fanuc, left = sheet.plunge(), robots.Fanuc.measured(), robots.left()
    fine, coarse = sheet.ELEMENTS
    return {
        "rest": engines.rest(),
        "step": engines.force_step(),
        "path": engines.path("nobacklash"),
        "path_backlash": engines.path("backlash"),
        "robots": engines.ROBOTS,
        "mechanics": engines.mechanics(),
        "random_rest": engines.random_rest(),
        "fine": plunge.compared(fine),
        "fine_mm": f"{plunge.side / fine:.3g}",
        "coarse": plunge.compared(coarse),
        "coarse_mm": f"{plunge.side / coarse:.3g}",
        "fanuc": fanuc,
        "joints": fanuc.joints,
        "tilt": fanuc.tilt,
        "stiffer": robots.stiffer(),
        **recordings.values(),
        **motion.values(),
        **breakthrough.values(),
        **drives.values(),
        **left,
        "before": 1e6 * left["as_file"].of,
        **{f"{name}_um": 1e6 * found.deviation for name, found in left.items()},
    }


def write() -> None:
    """Run what is run, and write page, pictures and summary."""
    values = {**computed(), **published()}
    save("trust", figures.bars([v for v in values.values() if isinstance(v, Comparison)]))
    save(
        "trust_sheet",
        figures.plate(sheet.plunge()),
        figures.axial_force(sheet.AxialForce.published()),
    )
    fits = {"six joints": identified(), "and a tilt of joint 3": identified("supported")}
    save("trust_robot", figures.deflections(fits))
    fill("trust", **values)
    replace("../README", "trust", SUMMARY.format(**values))


if __name__ == "__main__":
    sys.exit(finish(write))
