"""Motor, servo and friction of a joint as data."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from elastic_robot.requirements import require_number


@dataclass(frozen=True)
class Drive:
    """Motor, servo and friction of a joint, seen at the gear's output.

    The motor's angle q obeys J q'' = tau - T - f with the gear's torque T on its link, the friction f
    with the elongation s of a stop element, and tau of a servo, a rate loop in a position loop:

        f = (F (1 - c (1 - exp(-(q' / v)^2))) + mu |T|) s / a + b q',
        tau = sat(Kp w + z),    z' = Ki w,    w = Kv (q_cmd - q) + kff q_cmd' - q'.

    mu |T| is what the gear loses of its torque: a gear of efficiency eta has mu = 1 / eta - 1. Rotors
    are taken to turn about their joints' axes alone (Spong 1987, docs/references.md).

    Attributes:
        inertia: Rotor's inertia times the gear ratio squared, J [kg m^2], > 0.
        friction: Friction that must be overcome at rest, F [N m], >= 0.
        slip_angle: Angle over which it builds up (presliding), a [rad], > 0.
        viscous: Viscous friction b [N m s/rad], >= 0.
        load_friction: Friction over the gear's torque, mu, >= 0 and < 1.
        stribeck: Part c of the friction at rest that is lost at higher rates, 0 to 1 (Stribeck).
        stribeck_rate: Rate v at which 63 % of that are lost [rad/s], > 0.
        position_gain: Gain Kv of the position loop [1/s], > 0.
        rate_gain: Gain Kp of the rate loop [N m s/rad], > 0.
        integral_gain: Its integral gain Ki [N m/rad], >= 0.
        feed_forward: Part kff of the commanded rate that is fed forward.
        torque_limit: Largest torque of the motor [N m], > 0, or None for no limit.
        torque_per_current: Torque per current of the motor [N m/A], > 0, or None where it is unknown; of
            use where currents are measured.

    Raises:
        ValueError: If a value is out of its range.
    """

    inertia: float
    position_gain: float
    rate_gain: float
    integral_gain: float = 0.0
    feed_forward: float = 1.0
    friction: float = 0.0
    slip_angle: float = 2e-5
    viscous: float = 0.0
    load_friction: float = 0.0
    stribeck: float = 0.0
    stribeck_rate: float = 0.05
    torque_limit: float | None = None
    torque_per_current: float | None = None

    def __post_init__(self) -> None:
        for key, unit in (
            ("inertia", "kg m^2"),
            ("position_gain", "1/s"),
            ("rate_gain", "N m s/rad"),
            ("slip_angle", "rad"),
            ("stribeck_rate", "rad/s"),
        ):
            require_number(key, getattr(self, key), minimum=0.0, open_end=True, unit=unit)
        for key, unit in (
            ("integral_gain", "N m/rad"),
            ("friction", "N m"),
            ("viscous", "N m s/rad"),
            ("load_friction", "1"),
            ("stribeck", "1"),
            ("feed_forward", "1"),
        ):
            require_number(key, getattr(self, key), minimum=0.0, open_end=False, unit=unit)
        if self.stribeck > 1.0:
            raise ValueError(f"stribeck: expected at most 1, got {self.stribeck!r}")
        if self.load_friction >= 1.0:
            raise ValueError(f"load_friction: expected less than 1, got {self.load_friction!r}")
        for key, unit in (("torque_limit", "N m"), ("torque_per_current", "N m/A")):
            value = getattr(self, key)
            if value is not None:
                require_number(key, value, minimum=0.0, open_end=True, unit=unit)

    def friction_torque(
        self,
        friction: float | np.ndarray,
        part: np.ndarray,
        rate: np.ndarray,
        gear_torque: np.ndarray,
    ) -> np.ndarray:
        """Return f [N m] with F [N m], at s / a, q' [rad/s] and T [N m], any shape."""
        lost = self.stribeck * (1.0 - np.exp(-((rate / self.stribeck_rate) ** 2)))
        of_load = self.load_friction * np.abs(gear_torque)
        return np.asarray((friction * (1.0 - lost) + of_load) * part + self.viscous * rate)
