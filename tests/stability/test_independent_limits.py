"""Limits of robots against a computation that shares nothing with this one but the robot's numbers.

There the mass matrix is a sum of Jacobians of the links, stiffness a central difference of the weight,
the mean wrench a sum over edges, and the equation with delay is stepped by Runge-Kutta over the passing
of a tooth, at whose end an Arnoldi iteration takes the largest multiplier.  So are the growths at 1.15
times the limits.
"""

import json
import re
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest
from places import CASES

from coupling.case.file import load_case
from coupling.stability.case_cut import CaseCuts
from coupling.stability.floquet import vibration_of
from coupling.stability.judgement import Judgement

# K_tc, K_rc, K_ac [Pa], K_te, K_re, K_ae [N/m].
MATERIALS = {
    "aluminium": (7.67e8, 1.69e8, 2.22e8, 2.77e4, 2.66e4, 7e2),
    "steel": (1.9e9, 8e8, 3.5e8, 3e4, 4.5e4, 2e3),
    "titanium": (1.9e9, 6e8, 3e8, 2.4e4, 4.3e4, 7e2),
}


class Cut(NamedTuple):
    """A cut, its limit [mm], and the growth at 1.15 times that [1/s]; feed 8000 mm/min."""

    robot: str
    posture_deg: list[float]
    feed_deg: float
    part_rpy_deg: list[float]
    rpm: float
    material: str
    teeth: int
    helix_deg: float
    diameter_m: float
    engagement: str
    radial_depth_m: float
    tool: tuple[float, float, float] | None
    border: str
    limit_mm: float
    growth_1_s: float


# fmt: off
CUTS = {
    "low immersion": Cut(
        "icme2008", [-14.233589, 27.945959, 12.473234, -3.066928, 73.108097, -3.632037],
        197.854, [0, 0, 0], 1049.1, "steel", 3, 0, 0.02, "up", 0.000841, None, "flip", 3.8579, 6.85),
    "1000 1/min, flip": Cut(
        "icme2008", [3.717637, 0.403878, 33.595266, 0.379814, 60.435531, 10.121185],
        53.252, [12.09, -12.35, -16.74], 969.2, "steel", 3, 45, 0.02, "up", 0.012616, None, "flip",
        1.0047, 3.363),
    "fast, robot decides": Cut(
        "icme2008", [-8.639287, -6.595833, 37.659485, 12.888686, 42.510145, 3.969509],
        190.744, [0, 0, 0], 21886.8, "aluminium", 4, 0, 0.01, "slot", 0, (1314.6, 0.0327, 29317097.0),
        "Hopf", 4.641, 66.7),
    "fast, tool flips": Cut(
        "fanuc_r2000ic", [11.115267, -5.294073, -1.418242, 8.374752, -84.640821, -0.511651],
        168.714, [0, 0, 0], 20543.9, "steel", 2, 0, 0.01, "up", 0.003604, (1011.1, 0.0236, 13250147.0),
        "flip", 1.3465, 18.17),
    "1000 1/min, helix": Cut(
        "fanuc_r2000ic", [0.113446, 9.743663, -22.7855, -8.527331, -59.748956, 15.708154],
        265.671, [4.72, 8.05, -19.47], 1022.2, "titanium", 4, 30, 0.01, "down", 0.007309, None, "flip",
        0.78793, 13.06),
    "long helix": Cut(
        "fanuc_r2000ic", [15.350513, 0.70004, -19.727281, -19.208926, -52.264179, -2.14355],
        128.612, [12.05, 3.91, -0.25], 5411.5, "titanium", 2, 45, 0.016, "down", 0.009967, None, "flip",
        5.9772, 64.42),
    "backlash, fast": Cut(
        "kuka_kr300", [-15.314703, 44.974494, 22.695775, -9.212989, 64.496484, 14.104273],
        87.196, [-12.69, -0.84, 9.22], 18361.9, "aluminium", 3, 0, 0.016, "slot", 0,
        (806.0, 0.0108, 12760189.0), "Hopf", 0.93438, 10.35),
    "backlash, 1000 1/min": Cut(
        "kuka_kr300", [-14.648984, 23.422114, 28.376422, -13.623217, 49.317113, -18.957283],
        179.953, [0, 0, 0], 1009.2, "titanium", 2, 30, 0.01, "down", 0.006142, None, "Hopf", 0.22672,
        0.7394),
    "zero order 3 times wrong": Cut(
        "kuka_kr300", [13.026138, 46.73823, 10.103309, -15.80888, 55.346978, -15.785216],
        169.938, [0, 0, 0], 439.5, "steel", 4, 0, 0.016, "up", 0.001868, None, "flip", 0.76437, 0.5818),
}
# fmt: on


def case_of(folder: Path, cut: Cut) -> Path:
    text = (CASES / "milling_20000.toml").read_text()
    engaged = json.dumps(cut.engagement)
    if cut.engagement != "slot":
        engaged += f"\nradial_depth_m = {cut.radial_depth_m}"
    names = ("K_tc_Pa", "K_rc_Pa", "K_ac_Pa", "K_te_N_m", "K_re_N_m", "K_ae_N_m")
    keys = {
        "description": json.dumps(cut.robot),
        "position_m": f"[1.6, 0.0, 0.8]\nrpy_deg = {cut.part_rpy_deg}",
        "cutter_diameter_m": cut.diameter_m,
        "teeth": cut.teeth,
        "helix_deg": cut.helix_deg,
        "engagement": engaged,
        **dict(zip(names, MATERIALS[cut.material], strict=True)),
    }
    for key, value in keys.items():
        text, count = re.subn(rf"(?m)^{key} .*$", f"{key} = {value}", text)
        assert count == 1
    if cut.tool is not None:
        frequency, ratio, stiffness = cut.tool
        text += f"\n[[stability.tool_mode]]\nfrequency_Hz = {frequency}\ndamping_ratio = {ratio}\n"
        text += f"stiffness_N_m = {stiffness}\n"
    file = folder / "case.toml"
    file.write_text(text)
    return file


@pytest.mark.parametrize("cut", CUTS.values(), ids=CUTS.keys())
def test_limit_and_growth_are_those_of_an_independent_computation(tmp_path, cut):
    cuts = CaseCuts(load_case(case_of(tmp_path, cut)))
    posture, feed, limit = (
        np.deg2rad(cut.posture_deg),
        np.deg2rad(cut.feed_deg),
        1e-3 * cut.limit_mm,
    )
    judgement = Judgement.of(cuts, cuts.in_posture(posture, feed, cut.rpm, limit))
    assert judgement.limit == pytest.approx(limit, rel=3e-3)
    assert vibration_of(judgement.there.whole, judgement.placed.cut).border == cut.border
    deeper = Judgement.of(cuts, cuts.in_posture(posture, feed, cut.rpm, 1.15 * limit))
    assert deeper.vibration.growth == pytest.approx(cut.growth_1_s, rel=5e-3)
