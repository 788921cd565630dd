"""How far the mean force across the feed falls from 20,000 to 40,000 1/min at equal feed, by its parts.

    python -m docs.scripts.milling_fall

The paper measured 334.1 and 209.6 N. What the coefficients alone give is that of a rigid robot; what
else the measurement holds, a tool that gives way, cuts deeper and vibrates, is the rest.
"""

from __future__ import annotations

from coupling.case.case import Case
from coupling.run.cut_check import CUT_STABILITY
from coupling.run.execute import run_coupling
from docs.scripts.make_milling import dynamic, quasistatic

MEASURED = (334.1, 209.6)  # [N]
# Ratio K_te/K_tc of the review for 7075-T6 [mm], and chips at both speeds [mm].
REVIEWED, CHIPS = 27.7 / 767.0, (0.2, 0.1)


def fall(first: float, second: float) -> str:
    """Return two forces [N] and by how much the second is less."""
    return f"{first:8.1f} {second:8.1f} {100.0 * (1.0 - second / first):8.1f}"


def across(case: Case) -> tuple[float, float]:
    """Return the mean force across on the robot and on a rigid one [N]."""
    force = run_coupling(case).of(CUT_STABILITY).force
    assert force is not None
    return force.robot_N, force.rigid_N


def main() -> None:
    """Print the forces at both speeds and the fall, part by part."""
    print(f"{'':46} {'20,000':>8} {'40,000':>8} {'fall [%]':>8}")
    print(f"{'measured':46} {fall(*MEASURED)}")
    of_review = [chip / 4.0 + REVIEWED / 3.141592653589793 for chip in CHIPS]
    scale = MEASURED[0] / of_review[0]
    print(f"{'rigid, K_te/K_tc of the review (scaled)':46} {fall(*(scale * f for f in of_review))}")
    still, teeth = (
        [across(of(speed)) for speed in (20000, 40000)] for of in (quasistatic, dynamic)
    )
    print(f"{'rigid, K_te/K_tc = 0.055 mm of the cases':46} {fall(*(rigid for _, rigid in still))}")
    print(f"{'robot that gives way, mean force':46} {fall(*(robot for robot, _ in still))}")
    print(f"{'robot that vibrates, every tooth':46} {fall(*(robot for robot, _ in teeth))}")


if __name__ == "__main__":
    main()
