"""A robot that touches a plane: the Python and the C model behind one face, and an independent one."""

from dataclasses import dataclass, field

import numpy as np
from complex_robot import Numbers, acceleration, changed, evaluate
from exchanged_robot import ExchangedRobot
from native_core import Core
from pendulum import held
from scipy.integrate import solve_ivp

from elastic_robot.description import Robot
from elastic_robot.parameters import Parameters
from elastic_robot.plane_contact import PlaneContact
from elastic_robot.tool_load import ContactSpring, Load

KINDS = ("python", "native")


def onto(
    contact: PlaneContact,
    anchor=(0.0, 0.0, 0.0),
    velocity=(0.0, 0.0, 0.0),
    force=(0.0, 0.0, 0.0),
    spring: float = 0.0,
) -> Load:
    """A load of a force and a contact whose plane goes through an anchor, on a spring [N/m] as well."""
    place, speed = np.array(anchor, dtype=float), np.array(velocity, dtype=float)
    return Load(
        np.append(np.array(force, dtype=float), np.zeros(3)),
        ContactSpring(place, speed, spring * np.eye(3)),
        contact=contact,
    )


def entries(load: Load) -> np.ndarray:
    """The load as the C core takes it."""
    spring, contact = load.spring, load.contact
    numbers = [contact.stiffness, contact.dissipation, contact.radius, contact.friction]
    numbers += [contact.slip_speed, *contact.normal]
    k = spring.stiffness[np.triu_indices(3)]
    return np.concatenate([load.wrench, spring.position, spring.velocity, k, numbers])


class Touching:
    """One robot of either kind, its drives at rest.

    Args:
        kind: One of `KINDS`.
        robot: Its description.
        q: Angles of the drives [rad].
        options: Of the model: tolerance, quasistatic.
    """

    def __init__(self, kind: str, robot: Robot, q, curve: str = "linear", **options) -> None:
        self.q, self._curve, self._options = np.array(q, dtype=float), curve, options
        self.python = ExchangedRobot(robot, curve, **options)
        self.core = Core(robot) if kind == "native" else None
        self.m = self.python.chain.elastic_count

    def reset(self, load: Load) -> None:
        if self.core is None:
            self.python.reset(0.0, held(self.q), load)
        else:
            self.core.reset(self._curve, 0.0, self.q, entries(load), **self._options)

    def step(self, end: float, load: Load) -> None:
        if self.core is None:
            self.python.step(end, held(self.q), load)
        else:
            self.core.step(end, self.q, entries(load))

    def x(self) -> np.ndarray:
        return self.python.deflection() if self.core is None else self.core.outputs(self.m)["x"]

    def velocity(self) -> np.ndarray:
        if self.core is None:
            return self.python.velocity()
        return self.core.outputs(self.m)["velocity"]

    def tcp(self) -> np.ndarray:
        return (self.python.tcp() if self.core is None else self.core.outputs(self.m)["tcp"])[:3]

    def force(self) -> np.ndarray:
        return self.python.contact_force() if self.core is None else self.core.contact()[0][:3]

    def gap(self) -> float:
        return float(self.python.contact_gap()[0]) if self.core is None else -self.core.contact()[1]


@dataclass
class Independent:
    """Newton's and Euler's laws in complex arithmetic, by DOP853, which ends a run at every event.

    Attributes:
        robot: The robot, its curve linear.
        q: Angles of the drives [rad].
        events: Times at which the contact began or ended [s].
    """

    robot: Robot
    q: np.ndarray
    events: list[float] = field(default_factory=list)

    def run(self, load: Load, x: np.ndarray, times: np.ndarray) -> np.ndarray:
        """Return x and x' at rising times from rest at 0, (k, 2 m)."""
        y, t, rows = np.concatenate([x, 0.0 * x]), 0.0, []
        touching = self._feel(load, 0.0, y)[1] > 0.0
        # A seventh of how long 50 kg touch, so that no step passes both ends of a contact.
        longest = np.sqrt(10.0 / load.contact.stiffness)
        while t < times[-1]:
            law = touching  # of this run

            def motion(t, y, law=law):
                wrench = load.wrench + law * self._feel(load, t, y)[0]
                numbers = changed(self._numbers(y), wrench=wrench)
                return np.append(y[len(x) :], acceleration(self.robot, "linear", numbers).real)

            def depth(t, y):
                return self._feel(load, t, y)[1]

            depth.terminal, depth.direction = True, -1.0 if law else 1.0  # type: ignore[attr-defined]
            due = times[times > t + 1e-15]
            short = {"first_step": 1e-7, "max_step": longest} if law else {}
            run = solve_ivp(
                *(motion, (t, times[-1]), y, "DOP853", due),
                **{"events": depth, "rtol": 1e-11, "atol": 1e-14, **short},
            )
            rows += list(np.array(run.y).T)  # a list where none was due
            if run.status != 1:
                break
            t, y, touching = float(run.t_events[0][0]), run.y_events[0][0], not touching
            self.events.append(t)
        return np.array(rows)

    def _numbers(self, y: np.ndarray) -> Numbers:
        p, (x, v) = Parameters.of(self.robot), np.split(y, 2)
        drives, motion = np.array([self.q, 0 * self.q, 0 * self.q]), np.array([x, v, 0 * x])
        given = (np.zeros(6), p.gravity, p.stiffness, p.damping, p.backlash)
        return Numbers(drives, motion, *given)

    def _feel(self, load: Load, t: float, y: np.ndarray) -> tuple[np.ndarray, float]:
        """The law written out again: wrench of the contact at the TCP, pressing or not; depth."""
        contact, tool = load.contact, evaluate(self.robot, self._numbers(y))
        n = contact.normal / np.linalg.norm(contact.normal)
        plane = load.spring.position + t * load.spring.velocity
        depth = contact.radius - n @ (tool.position.real - plane)
        lowest = -contact.radius * n
        slide = tool.velocity.real + np.cross(tool.spin.real, lowest) - load.spring.velocity
        rate = -n @ slide
        normal = contact.stiffness * depth * max(0.0, 1.0 + contact.dissipation * rate)
        across = slide + rate * n
        friction = (
            contact.friction
            * normal
            * across
            / np.hypot(np.linalg.norm(across), contact.slip_speed)
        )
        force = normal * n - friction
        return np.append(force, np.cross(lowest, force)), float(depth)
