"""Write the table of docs/import.md on inputs between communication points: make commands."""

from __future__ import annotations

import numpy as np

from coupling.files.robot_file import load_robot, shipped_robots
from coupling.fmu.job import SimulationJob
from docs.scripts.experiment import Page, scratch
from docs.scripts.page import table
from docs.scripts.trust_fmu import answers

RATES = (64, 128, 256)  # steps a second
DURATION = 2.5  # [s]
POSTURE = np.array([0.0, -0.3, 0.5, 0.0, 0.6, 0.0])
AMPLITUDE, OMEGA = 0.2, 2.0 * np.pi * 0.8
FORCE, FORCE_OMEGA = 300.0, 2.0 * np.pi * 5.0
# The tolerance leaves less than what is shown [m].
TOLERANCE = 1e-8
_FINE = 16 * RATES[-1]
_COMMANDS = tuple(f"{name}_cmd[{i + 1}]" for name in ("q", "qd", "qdd") for i in range(6))
PAGE = Page("import")


def swing(time: np.ndarray, phase: float) -> np.ndarray:
    """Return q, q' and q'' of all axes that swing about a posture, (n, 18).

    Args:
        time: Times [s], (n,).
        phase: Angle of the swing at time 0 [rad]; 0: at a turning point.
    """
    c, s = np.cos(OMEGA * time + phase), np.sin(OMEGA * time + phase)
    orders = AMPLITUDE * np.column_stack([-c, OMEGA * s, OMEGA**2 * c])
    motion = np.repeat(orders, 6, axis=1)
    motion[:, :6] += POSTURE
    return motion


def times(rate: int) -> np.ndarray:
    """Return the communication points [s]."""
    return np.arange(round(DURATION * rate) + 1) / rate


def commanded(rate: int, phase: float, orders: int = 3) -> SimulationJob:
    """Return a simulation of the swing by inputs, of which the first orders of q, q', q'' are given."""
    rows = swing(times(rate), phase)
    rows = np.vstack([rows[0], rows[:-1]])  # a step has the command of its start
    rows[1:, 6 * orders :] = 0.0
    return _job({}, times(rate), _COMMANDS, rows)


def along(rate: int, phase: float) -> SimulationJob:
    """Return a simulation with the swing as `trajectory`."""
    time = times(1024)
    file = scratch(f"motion_{phase}.npz")
    columns = ["time", *(f"{n}{i + 1}" for n in ("q", "qd", "qdd") for i in range(6))]
    np.savez(file, columns=columns, data=np.column_stack([time, swing(time, phase)]))
    rows = np.zeros((len(times(rate)), 1))
    return _job({"trajectory": str(file)}, times(rate), ("force.z",), rows)


def pushed(rate: int, slope: str = "none") -> SimulationJob:
    """Return a simulation of the resting robot under a force, with no slope, its own or a chord's."""
    time = times(rate)
    force = FORCE * np.sin(FORCE_OMEGA * time)
    slopes = {
        "none": np.zeros(len(time) - 1),
        "exact": FORCE * FORCE_OMEGA * np.cos(FORCE_OMEGA * time[:-1]),
        "chord": rate * np.diff(force),
    }
    rows = np.zeros((len(time), 2))
    rows[1:] = np.column_stack([force[:-1], slopes[slope]])
    start: dict[str, str | float] = {
        f"q_cmd[{i + 1}]": float(angle) for i, angle in enumerate(POSTURE)
    }
    return _job(start, time, ("force.z", "force_rate.z"), rows)


def _job(
    settings: dict[str, str | float], time: np.ndarray, inputs: tuple[str, ...], rows: np.ndarray
) -> SimulationJob:
    settings = {"mode": "dynamic", "tcp_tolerance": TOLERANCE, **settings}
    return SimulationJob(settings, time, inputs, rows, ("tcp.x", "tcp.y", "tcp.z"), 3)


@PAGE.part
def commands() -> str:
    """Return the largest distances of the TCP from the exact motion, by steps a second."""
    turning, full = 0.0, 0.5 * np.pi

    def swung(phase: float, orders: int = 3) -> list[SimulationJob]:
        return [along(_FINE, phase), *(commanded(rate, phase, orders) for rate in RATES)]

    def forced(slope: str) -> list[SimulationJob]:
        return [pushed(_FINE, "chord"), *(pushed(rate, slope) for rate in RATES)]

    rows = {
        "all axes from a turning point": swung(turning),
        "from full swing": swung(full),
        "from a turning point, q and q' alone": swung(turning, 2),
        "from a turning point, q alone": swung(turning, 1),
        "force, held": forced("none"),
        "force, with its rate": forced("exact"),
    }
    jobs = [job for row in rows.values() for job in row]
    paths = iter(answers(load_robot(shipped_robots()["icme2008"]), jobs))
    lines = []
    for what in rows:
        exact = next(paths)
        apart = (next(paths) - exact[:: _FINE // rate] for rate in RATES)
        errors = [float(np.linalg.norm(own, axis=1).max()) for own in apart]
        order = np.log2(errors[-2] / errors[-1])
        lines.append((what, *(f"{1e6 * error:.2g}" for error in errors), f"{order:.1f}"))
    return table(("", *(f"{rate} 1/s" for rate in RATES), "order"), lines)


if __name__ == "__main__":
    PAGE.write()
