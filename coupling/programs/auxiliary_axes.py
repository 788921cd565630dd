"""Axes beside the robot's, as of a rail or a positioner: they must stand while the robot moves."""

from __future__ import annotations

from dataclasses import dataclass, field

from coupling.errors import ProgramError

# Values that differ by rounding alone [mm], [deg].
STANDSTILL = 1e-3


@dataclass
class AuxiliaryAxes:
    """Places of axes beside the robot's.

    Attributes:
        values: Places of the axes, by their names [mm], [deg].

    Example:
        >>> axes = AuxiliaryAxes()
        >>> axes.take("E1", 5.0, "line 1", has_begun=False)
        >>> axes.take("E1", 5.0, "line 2", has_begun=True)
        >>> axes.values
        {'E1': 5.0}
    """

    values: dict[str, float] = field(default_factory=dict)

    def take(
        self, name: str, value: float, where: str, *, has_begun: bool, may_move: bool = False
    ) -> None:
        """Note where an axis stands at a target.

        Args:
            name: Name of the axis.
            value: Its place [mm] or [deg].
            where: Place in the program, for messages.
            has_begun: Whether the robot has moved before.
            may_move: Whether it may go there: by a motion that is no part of the path.

        Raises:
            ProgramError: If it moves, or may have moved: one that was not given before is at zero, as
                it is without such an axis, or nobody knows where.
        """
        is_new = has_begun and name not in self.values
        if is_new and not may_move and abs(value) > STANDSTILL:
            raise ProgramError(
                f"{where}: expected {name} from the first target on, got {value:g} here first: give it"
                " there, if it does not move"
            )
        before = self.values.setdefault(name, value)
        if may_move:
            self.values[name] = value
        elif abs(value - before) > STANDSTILL:
            raise ProgramError(
                f"{where}: expected {name} to stand, got a move from {before:g} to {value:g}: only the"
                " robot's axes are computed"
            )
