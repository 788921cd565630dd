"""Judge random cuts of six robots, 15 % off their border, by marching them in time."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from coupling.stability.case_cut import CaseCuts
from coupling.stability.floquet import growth_of
from coupling.stability.judgement import Judgement
from coupling.stability.marching import Marched, march
from docs.scripts.runs import example

# Robots in a usual posture [deg], and by how much it is changed.
ROBOTS = {
    "icme2008": (0, 10, 20, 0, 60, 0),
    "fanuc_r2000ic": (0, 10, -10, 0, -70, 0),
    "kuka_kr300": (0, 30, 15, 0, 45, 0),
    "kuka_kr210": (0, 20, 10, 0, 60, 0),
    "abb_irb7600": (0, 20, 10, 0, 60, 0),
    "manutec_r3": (0, 20, 30, 0, 60, 0),
}
TURNED = 15.0
# Aluminium, steel, titanium: K_tc, K_rc, K_ac [Pa], K_te, K_re, K_ae [N/m].
MATERIALS = (
    (7.67e8, 1.69e8, 2.22e8, 2.77e4, 2.66e4, 7.0e2),
    (1.9e9, 8.0e8, 3.5e8, 3.0e4, 4.5e4, 2.0e3),
    (1.9e9, 6.0e8, 3.0e8, 2.4e4, 4.3e4, 7.0e2),
)
COEFFICIENTS = ("K_tc_Pa", "K_rc_Pa", "K_ac_Pa", "K_te_N_m", "K_re_N_m", "K_ae_N_m")
SHARES = (0.85, 1.15)
# Way from tooth to tooth [m]; times of growth that are marched, and at most so many seconds and steps.
FEED, TIMES, LONGEST, STEPS = 1e-4, 12.0, 20.0, 600_000


@dataclass(frozen=True)
class JudgedCut:
    """A cut with its growth by multipliers [1/s], and marched in time.

    Attributes:
        growth: Growth by the multipliers [1/s].
        marched: The same cut, marched.
    """

    growth: float
    marched: Marched

    @property
    def agrees(self) -> bool:
        """Whether both say the same."""
        return self.marched.is_stable == (self.growth < 0.0)


def judged_cuts(count: int, seed: int = 1) -> list[JudgedCut]:
    """Return cuts whose limit is a border that they are 15 % above or below."""
    rng = np.random.default_rng(seed)
    judged: list[JudgedCut] = []
    while len(judged) < count:
        cut = _random_cut(rng)
        if cut is not None:
            judged.append(cut)
    return judged


def _random_cut(rng: np.random.Generator) -> JudgedCut | None:
    """Return a random cut; None where it has no limit, or is in an island beyond it."""
    name = list(ROBOTS)[rng.integers(len(ROBOTS))]
    material = MATERIALS[rng.integers(3)]
    engagement = ("slot", "up", "down")[rng.integers(3)]
    radial = {} if engagement == "slot" else {"radial_depth_m": float(rng.uniform(1e-3, 8e-3))}
    process = {
        "engagement": engagement,
        "teeth": int(rng.integers(2, 5)),
        "helix_deg": float(rng.choice([0.0, 30.0])),
        **radial,
        **dict(zip(COEFFICIENTS, material, strict=True)),
    }
    home = [float(angle) for angle in ROBOTS[name]]
    robot = {"description": name, "home_deg": home}
    cuts = CaseCuts(example("milling_20000", robot=robot, process=process))
    posture = np.deg2rad(np.array(home) + rng.uniform(-TURNED, TURNED, 6))
    rpm = float(np.exp(rng.uniform(np.log(800.0), np.log(20000.0))))
    placed = cuts.in_posture(posture, float(rng.uniform(0.0, 2.0 * np.pi)), rpm, 2e-3)
    judgement = Judgement.of(cuts, placed)
    if not 5e-5 < judgement.limit < 5e-2:
        return None
    share = float(rng.choice(SHARES))
    structure, cut = judgement.there.whole, placed.cut.at_depth(share * judgement.limit)
    growth = growth_of(structure, cut)
    if (share > 1.0) != (growth > 0.0):
        return None
    steps = max(60.0, 24.0 * structure.fastest * cut.period / (2.0 * np.pi))
    seconds = min(np.clip(TIMES / abs(growth), 0.5, LONGEST), STEPS / steps * cut.period)
    return JudgedCut(growth, march(structure, cut, FEED, float(seconds)))
