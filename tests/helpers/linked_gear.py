"""One mass behind one gear, simulated by a program of its own."""

import numpy as np

from coupling.inverse.gear_drive import GearTask
from coupling.inverse.spline import UniformSpline

END, INERTIA = 0.8, 20.0  # [s], [kg m^2]


def load(times: np.ndarray) -> np.ndarray:
    """Torque on the link that turns round [N m]; steady at both ends."""
    s = np.clip((times - 0.1) / 0.6, 0.0, 1.0)
    values: np.ndarray = 30.0 * np.cos(4 * np.pi * (s - np.sin(2 * np.pi * s) / (2 * np.pi)))
    return values


def simulated_miss(task: GearTask, command: UniformSpline, step: float = 5e-4) -> np.ndarray:
    """M y'' + d (y - q)' + S(y - q) + sum f s / a = load by Runge and Kutta's steps: y - phi."""
    time = np.linspace(0.0, END, 2 * round(END / step) + 1)
    q, rate, pull = command.at(time)[:, 0], command.at(time, 1)[:, 0], load(time)
    a, stiffness = task.elements.slip_angle, task.elements.slip_torque / task.elements.slip_angle

    def bend(j, y, v, s, before):
        x = y - q[j]
        h = stiffness @ np.clip(s + x - before, -a, a) if len(a) else 0.0
        spring = task.curve.torque(np.array([x]))[0] + task.damping * (v - rate[j])
        return (pull[j] - spring - h) / INERTIA

    y, v = float(task.link.at(time[:1])[0, 0]), 0.0
    x = y - q[0]
    # Its elements come to the wind-up from unloaded.
    s, found = np.clip(x, -a, a), [y]
    for j in range(0, len(time) - 1, 2):
        a1 = bend(j, y, v, s, x)
        a2 = bend(j + 1, y + step / 2 * v, v + step / 2 * a1, s, x)
        a3 = bend(j + 1, y + step / 2 * (v + step / 2 * a1), v + step / 2 * a2, s, x)
        a4 = bend(j + 2, y + step * (v + step / 2 * a2), v + step * a3, s, x)
        y = y + step * (v + step / 6 * (a1 + a2 + a3))
        v = v + step / 6 * (a1 + 2 * a2 + 2 * a3 + a4)
        before, x = x, y - q[j + 2]
        s = np.clip(s + x - before, -a, a)
        found.append(y)
    return np.array(found) - task.link.at(time[::2])[:, 0]
