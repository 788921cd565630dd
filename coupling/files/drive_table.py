"""[joint.drive] of a robot file: motor, servo and friction of a joint."""

from __future__ import annotations

from math import inf, pi
from typing import Annotated

from pydantic import Field, model_validator

from coupling.errors import locate_errors
from coupling.files.toml_file import Positive, Schema
from elastic_robot.drive import Drive

_NotNegative = Annotated[float, Field(ge=0.0)]
# Rate loops of any drive [Hz]: the slowest axes follow a rate within seconds, and the quickest servo
# drives on the market have some 3 kHz in their data sheets.
_RATE_LOOPS = (0.1, 1e4)


class FrictionTable(Schema):
    """`friction` of a drive, at the gear's output."""

    coulomb_Nm: _NotNegative = 0.0
    stiction_Nm: _NotNegative | None = None
    stribeck_rate: Positive = Drive.stribeck_rate
    viscous_Nm_s: _NotNegative = Drive.viscous
    presliding_rad: Positive = Drive.slip_angle

    @model_validator(mode="after")
    def _stiction_is_more(self) -> FrictionTable:
        if self.stiction_Nm is None:
            return self
        if "coulomb_Nm" not in self.model_fields_set:
            raise ValueError(
                f"coulomb_Nm: expected one beside stiction_Nm = {self.stiction_Nm!r}, got none"
            )
        if self.stiction_Nm < self.coulomb_Nm:
            raise ValueError(
                f"stiction_Nm: expected at least coulomb_Nm, {self.coulomb_Nm:.6g} N m, got"
                f" {self.stiction_Nm:.6g} N m"
            )
        return self

    @property
    def at_rest(self) -> float:
        """Friction that must be overcome at rest [N m]."""
        return self.coulomb_Nm if self.stiction_Nm is None else self.stiction_Nm

    @property
    def lost(self) -> float:
        """Part of it that is lost at high rates."""
        return (self.at_rest - self.coulomb_Nm) / self.at_rest if self.at_rest else 0.0


class ServoTable(Schema):
    """`servo` of a drive: a rate loop in a position loop, at the gear's output."""

    position_gain: Positive
    rate_bandwidth_Hz: Positive | None = None
    rate_gain: Positive | None = None
    integral_time_s: Positive | None = None
    integral_gain: _NotNegative | None = None
    rate_feed_forward: _NotNegative = Drive.feed_forward

    @model_validator(mode="after")
    def _one_form(self) -> ServoTable:
        for first, other in (
            ("rate_bandwidth_Hz", "rate_gain"),
            ("integral_time_s", "integral_gain"),
        ):
            if getattr(self, first) is not None and getattr(self, other) is not None:
                raise ValueError(f"expected either {first} or {other}, got both")
        if self.rate_bandwidth_Hz is None and self.rate_gain is None:
            raise ValueError("expected rate_bandwidth_Hz or rate_gain, got neither")
        return self

    def gains(self, inertia: float) -> tuple[float, float]:
        """Return Kp [N m s/rad] and Ki [N m/rad] with a rotor's inertia J at the output [kg m^2].

        A rotor alone, without its gear, follows a rate as J w' = Kp (w_cmd - w): as far as f with
        Kp = 2 pi f J.
        """
        rate, integral = self.rate_gain, self.integral_gain or 0.0
        if rate is None:
            assert self.rate_bandwidth_Hz is not None
            rate = inertia * 2.0 * pi * self.rate_bandwidth_Hz
            _require("rate_bandwidth_Hz", "2 pi f J", rate, "N m s/rad")
        if self.integral_time_s is not None:
            integral = rate / self.integral_time_s
            _require("integral_time_s", "Kp / T", integral, "N m/rad")
        self._require_a_servo(inertia, rate / inertia, integral / rate)
        return rate, integral

    def _require_a_servo(self, inertia: float, rate_loop: float, integral: float) -> None:
        """Refuse loops that no drive has, by J [kg m^2], Kp / J and Ki / Kp [1/s].

        A rotor alone goes by s^3 + a s^2 + a (Kv + b) s + a b Kv with these a and b, which swings up
        unless a (Kv + b) > b Kv (Routh).
        """
        lowest, highest = _RATE_LOOPS
        bandwidth = rate_loop / (2.0 * pi)
        if not lowest <= bandwidth <= highest:
            key = "rate_gain" if self.rate_bandwidth_Hz is None else "rate_bandwidth_Hz"
            raise ValueError(
                f"{key}: expected a rate loop of {lowest:g} to {highest:g} Hz, got {bandwidth:.4g} Hz"
                f" with a rotor of {inertia:.4g} kg m2 at the gear's output"
            )
        kv = self.position_gain
        if not rate_loop * (kv + integral) > integral * kv:
            least = integral * kv / (kv + integral) / (2.0 * pi)
            raise ValueError(
                f"expected loops in which the rotor comes to rest, got a rate loop of {bandwidth:.4g} Hz"
                f" that swings up with its integral and position_gain = {kv:g}: more than {least:.4g}"
                " Hz, or less of these"
            )


class DriveTable(Schema):
    """[joint.drive]: rotor as in the motor's data sheet, friction and servo at the gear's output."""

    rotor_inertia_kg_m2: Positive
    gear_ratio: Positive
    friction: FrictionTable = FrictionTable()
    servo: ServoTable
    max_torque_Nm: Positive | None = None
    torque_constant_Nm_A: Positive | None = None

    @model_validator(mode="after")
    def _motor_is_stronger_than_its_friction(self) -> DriveTable:
        friction = self.friction.at_rest
        if self.max_torque_Nm is not None and self.max_torque_Nm <= friction:
            raise ValueError(
                f"max_torque_Nm: expected more than the friction at rest, {friction:.6g} N m, got"
                f" {self.max_torque_Nm:.6g} N m"
            )
        return self

    def drive(self, load_friction: float = 0.0) -> Drive:
        """Return the drive, all its numbers at the gear's output.

        Args:
            load_friction: Friction over the gear's torque, which its table [joint.gear] tells.

        Raises:
            ValueError: If one of them is beyond what numbers hold.

        Example:
            >>> servo = ServoTable(position_gain=20.0, rate_bandwidth_Hz=30.0, integral_time_s=0.02)
            >>> drive = DriveTable(rotor_inertia_kg_m2=5e-3, gear_ratio=200.0, servo=servo).drive()
            >>> drive.inertia, round(drive.rate_gain), round(drive.integral_gain)
            (200.0, 37699, 1884956)
        """
        inertia = self.rotor_inertia_kg_m2 * self.gear_ratio * self.gear_ratio
        _require("rotor_inertia_kg_m2", "rotor_inertia_kg_m2 gear_ratio^2", inertia, "kg m^2")
        constant = self.torque_constant_Nm_A
        per_current = None if constant is None else constant * self.gear_ratio
        if per_current is not None:
            _require(
                "torque_constant_Nm_A", "torque_constant_Nm_A gear_ratio", per_current, "N m/A"
            )
        with locate_errors("servo", ValueError):
            rate_gain, integral_gain = self.servo.gains(inertia)
        return Drive(
            inertia=inertia,
            position_gain=self.servo.position_gain,
            rate_gain=rate_gain,
            integral_gain=integral_gain,
            feed_forward=self.servo.rate_feed_forward,
            friction=self.friction.at_rest,
            slip_angle=self.friction.presliding_rad,
            viscous=self.friction.viscous_Nm_s,
            load_friction=load_friction,
            stribeck=self.friction.lost,
            stribeck_rate=self.friction.stribeck_rate,
            torque_limit=self.max_torque_Nm,
            torque_per_current=per_current,
        )


def drive_in_words(drive: Drive) -> str:
    """Return the numbers of a drive at the gear's output."""
    moving = (1.0 - drive.stribeck) * drive.friction
    limit = drive.torque_limit
    most = "" if limit is None else f"; at most {limit:.4g} N m"
    if drive.torque_per_current is not None:
        most += f"; {drive.torque_per_current:.4g} N m/A"
    loaded = f", {drive.load_friction:.4g} of the gear's torque" * (drive.load_friction > 0.0)
    return (
        f"rotor {drive.inertia:.4g} kg m2; friction {drive.friction:.4g} N m at rest, {moving:.4g} N m"
        f" and {drive.viscous:.4g} N m s/rad in motion{loaded}; servo {drive.position_gain:.4g} 1/s,"
        f" {drive.rate_gain:.4g} N m s/rad, {drive.integral_gain:.4g} N m/rad{most}"
    )


def _require(key: str, product: str, value: float, unit: str) -> None:
    if not 0.0 < value < inf:
        raise ValueError(f"{key}: expected a finite {product} > 0 [{unit}], got {value!r}")
