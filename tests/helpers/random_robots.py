"""Hypothesis strategies: serial robots with random axes, offsets, inertias, elasticities and tilts."""

from dataclasses import replace

import numpy as np
from hypothesis import strategies as st

from elastic_robot.body import Body
from elastic_robot.description import Joint, Robot, Tilt
from elastic_robot.drive import Drive
from elastic_robot.gear_parts import KinematicError, StopElement


def _unit(rng: np.random.Generator) -> tuple[float, ...]:
    vector = rng.normal(size=3)
    return tuple((vector / np.linalg.norm(vector)).tolist())


def _body(rng: np.random.Generator) -> Body:
    # Second moments of a positive mass distribution, hence physical in every case.
    points = rng.normal(size=(6, 3)) * rng.uniform(0.05, 0.4)
    points -= points.mean(axis=0)
    mass = rng.uniform(5.0, 300.0)
    moment = mass * points.T @ points / 6.0
    inertia = np.trace(moment) * np.eye(3) - moment
    return Body(
        mass=float(mass),
        com=tuple(rng.uniform(-0.4, 0.4, 3).tolist()),
        inertia=tuple(inertia[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]].tolist()),
    )


def make_robot(seed: int, joints: int, backlash: float = 1e-4) -> Robot:
    """Return a random robot; about one joint in four is rigid, tilts are 0 to 2 each."""
    rng = np.random.default_rng(seed)
    chain = []
    for _ in range(joints):
        axis = _unit(rng)
        # Perpendicular tilt axes, as of a bearing.
        first = np.cross(axis, _unit(rng))
        first /= np.linalg.norm(first)
        second = np.cross(axis, first)
        tilts = tuple(
            Tilt(
                tuple(a.tolist()), float(10.0 ** rng.uniform(6.0, 7.5)), float(rng.uniform(0, 1e4))
            )
            for a in (first, second)[: rng.integers(0, 3)]
        )
        elastic = rng.random() < 0.75
        chain.append(
            Joint(
                origin=tuple(rng.uniform(-0.8, 0.8, 3).tolist()),
                axis=axis,
                body=_body(rng),
                stiffness=float(10.0 ** rng.uniform(6.0, 7.5)) if elastic else None,
                damping=float(rng.uniform(0, 1e4)) if elastic else 0.0,
                backlash=backlash if elastic else 0.0,
                tilt=tilts,
            )
        )
    return Robot(
        name=f"random {seed}",
        joints=tuple(chain),
        gravity=tuple((9.81 * np.array(_unit(rng))).tolist()),
        tcp_position=tuple(rng.uniform(-0.3, 0.3, 3).tolist()),
        tcp_rpy=tuple(rng.uniform(-3.0, 3.0, 3).tolist()),
    )


def with_hysteresis(robot: Robot, seed: int) -> Robot:
    """Return the robot with up to three elements in each gear, of 10 to 60 N m over 10 to 200 urad."""
    rng = np.random.default_rng(seed)

    def elements() -> tuple[StopElement, ...]:
        count = rng.integers(0, 4)
        slips = zip(rng.uniform(10.0, 60.0, count), rng.uniform(1e-5, 2e-4, count), strict=True)
        return tuple(StopElement(float(torque), float(angle)) for torque, angle in slips)

    joints = [
        joint if joint.stiffness is None else replace(joint, hysteresis=elements())
        for joint in robot.joints
    ]
    return replace(robot, joints=tuple(joints))


def with_gear_parts(robot: Robot, seed: int) -> Robot:
    """Return the robot with kinematic errors in most joints and a balancer on most elastic ones.

    Errors of 1 to 3 sines of 20 to 200 urad, order 0.5 to 300; balancers of up to 3 kN m.
    """
    rng = np.random.default_rng([seed, 1])

    def sine() -> KinematicError:
        amplitude, order = rng.uniform(2e-5, 2e-4), 10.0 ** rng.uniform(-0.3, 2.5)
        return KinematicError(float(amplitude), float(order), float(rng.uniform(-3.0, 3.0)))

    def joint(own: Joint) -> Joint:
        errors = tuple(sine() for _ in range(rng.integers(0, 4)))
        angles = np.cumsum(rng.uniform(0.1, 1.0, rng.integers(3, 12)))
        torques = rng.normal(size=len(angles)) * 1e3
        table = np.column_stack([angles - angles.mean(), torques]).tolist()
        has = own.stiffness is not None and rng.random() < 0.75
        balancer = tuple((a, t) for a, t in table) if has else None
        return replace(own, kinematic_error=errors, balancer=balancer)

    return replace(robot, joints=tuple(map(joint, robot.joints)))


def driven(robot: Robot, rng: np.random.Generator) -> Robot:
    """The robot with hysteresis, motors, servos and friction in every gear; linear gears."""

    def joint(own: Joint) -> Joint:
        if own.stiffness is None:
            return own
        inertia = rng.uniform(5.0, 50.0)
        rate_gain = inertia * 2.0 * np.pi * rng.uniform(20.0, 40.0)
        drive = Drive(
            inertia,
            position_gain=rng.uniform(10.0, 30.0),
            rate_gain=rate_gain,
            integral_gain=rate_gain / 0.02,
            feed_forward=rng.uniform(0.0, 1.0),
            friction=rng.uniform(5.0, 40.0),
            slip_angle=rng.uniform(1e-5, 4e-5),
            viscous=rng.uniform(0.0, 40.0),
            stribeck=rng.uniform(0.0, 0.5),
            stribeck_rate=rng.uniform(0.01, 0.1),
        )
        stops = tuple(StopElement(rng.uniform(2.0, 20.0), a) for a in (2e-5, 6e-5, 1.5e-4))
        return replace(own, drive=drive, hysteresis=stops, torque_table=None)

    return replace(robot, joints=tuple(map(joint, robot.joints)))


def limited(robot: Robot, most: float) -> Robot:
    """The robot whose motors have at most so much torque [N m]."""
    drives = [j.drive and replace(j.drive, torque_limit=most) for j in robot.joints]
    joints = (replace(j, drive=d) for j, d in zip(robot.joints, drives, strict=True))
    return replace(robot, joints=tuple(joints))


def robots(backlash: float = 1e-4) -> st.SearchStrategy[Robot]:
    return st.builds(
        make_robot, st.integers(0, 10**6), st.integers(1, 8), backlash=st.just(backlash)
    )


def hardly_loaded(rng: np.random.Generator, joints: int) -> tuple[np.ndarray, np.ndarray]:
    """Return drive angles [rad] and a wrench [N, N m] that leave some gears nearly unloaded.

    Angles that are zero or nearly so line up the wrist, and the wrench may be rounding only.
    """
    q = rng.uniform(-1.5, 1.5, joints) * rng.choice([0, 1e-16, 1e-9, 1e-6, 1e-3, 1, 1, 1], joints)
    wrench = np.concatenate([rng.normal(size=3) * 300.0, rng.normal(size=3) * 20.0])
    return q, wrench * rng.choice([0.0, 0.0, 1e-9, 1e-3, 1.0])
