"""Values that a program does not tell: of inputs, of the robot, of what the controller holds."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Unknown:
    """A value that the program does not tell.

    Attributes:
        name: Words for it, for messages.
        step: Number of the statement that measured or computed it; 0 where it stays what it is.  Two of
            one name and step are one value.
    """

    name: str
    step: int = 0
