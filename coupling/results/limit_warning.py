"""A limit of a robot, or a tolerance of a case, that is passed."""

from __future__ import annotations

from coupling.results.base import ResultPart

# What is said of a limit that is passed, by its name.
_PASSED = {
    "rate": "joint {joint} moves at {value:.3g} rad/s at t = {time:.3f} s; its maximum rate is"
    " {limit:.3g} rad/s",
    "payload": "the force on the tool is {value:.5g} N at t = {time:.3f} s; the robot's rated load is"
    " {limit:.5g} N",
    "gear-torque-peak": "joint {joint}: its gear carries {value:.5g} N m at t = {time:.3f} s; its peak"
    " torque is {limit:.5g} N m",
    "effort": "joint {joint}: its gear carries {value:.5g} N m at t = {time:.3f} s; the effort of its"
    " URDF, the highest torque, is {limit:.5g} N m: correct it by gear_torque_Nm if it is none",
    "sampling": "linear interpolation of the force between the process's samples causes an estimated"
    " {value_um:.4g} um at t = {time:.3f} s; tolerance_m is {limit_um:.4g} um: lower sample_s, or give a"
    " path from a file more rows",
    "motor-torque": "joint {joint}: its motor needs {value:.5g} N m at t = {time:.3f} s; its torque"
    " limit is {limit:.5g} N m, {more:.3g} N m less",
    "motor-torque-warm": "joint {joint}: warm, with 30 % less friction, its motor needs"
    " {value:.5g} N m at t = {time:.3f} s; its torque limit is {limit:.5g} N m, {more:.3g} N m less",
    "motor-torque-cold": "joint {joint}: cold, with 30 % more friction, its motor needs"
    " {value:.5g} N m at t = {time:.3f} s; its torque limit is {limit:.5g} N m, {more:.3g} N m less",
    "gear-torque-emergency": "joint {joint}: its gear carries {value:.5g} N m at t = {time:.3f} s; its"
    " torque in an emergency stop is {limit:.5g} N m",
}


class LimitWarning(ResultPart):
    """A limit of the robot file is passed, or a tolerance of the case.

    Attributes:
        name: Name of the limit: "rate", "payload", "gear-torque-peak", "gear-torque-emergency",
            "effort", "motor-torque", "motor-torque-warm", "motor-torque-cold" or "sampling".
        value: Largest demand [rad/s], [N] or [N m]; of samples what they cost [m].
        limit: Limit of the robot, or the tolerance, in the same unit.
        joint: Number, from 1; None for what is no joint's.
        text: All of it in a sentence, in a cell of several robots with the robot's name.
    """

    name: str
    value: float
    limit: float
    time: float
    joint: int | None
    robot: str
    text: str

    @classmethod
    def of(
        cls,
        name: str,
        value: float,
        limit: float,
        time: float,
        joint: int | None = None,
        robot: str = "",
    ) -> LimitWarning:
        """Return the warning of a limit by its name."""
        text = _PASSED[name].format(
            joint=joint,
            value=value,
            limit=limit,
            time=time,
            more=value - limit,
            value_um=1e6 * value,
            limit_um=1e6 * limit,
        )
        text = f"{robot}: {text}" if robot else text
        return cls(
            name=name, value=value, limit=limit, time=time, joint=joint, robot=robot, text=text
        )

    def of_robot(self, name: str) -> LimitWarning:
        """Return the warning with the name of its robot, "" for the robot that is alone."""
        return self.of(self.name, self.value, self.limit, self.time, self.joint, name)

    def __str__(self) -> str:
        return self.text
