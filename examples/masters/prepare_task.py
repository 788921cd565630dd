"""Write motion.csv, the motion of the joints in the task that every script of this folder runs."""

import numpy as np

STEP = 1 / 128  # [s]; exact in binary, so every master adds up to the same times
time = np.arange(129) * STEP
start = np.array([0.0, -0.3, 0.5, 0.0, 0.6, 0.0])  # [rad]
turn = np.array([0.2, 0.1, -0.1, 0.0, 0.1, 0.0])
position = 10 * time**3 - 15 * time**4 + 6 * time**5
rate = 30 * time**2 - 60 * time**3 + 30 * time**4
acceleration = 60 * time - 180 * time**2 + 120 * time**3
np.savetxt(
    "motion.csv",
    np.column_stack(
        [time, start + np.outer(position, turn), np.outer(rate, turn), np.outer(acceleration, turn)]
    ),
    delimiter=",",
    header=",".join(["time", *(f"{name}{i}" for name in ("q", "qd", "qdd") for i in range(1, 7))]),
    comments="",
    fmt="%.17g",
)
