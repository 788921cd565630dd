"""Joint angles on the cycle of a sensor interface: time, q1, .. as the controller counts, SI units."""

from __future__ import annotations

import io

import numpy as np

from coupling.errors import ProgramError
from coupling.files.csv_table import write_table
from coupling.programs.program import ProgramFile, ProgramMove, RobotProgram
from coupling.programs.text import require_name

LONGEST_NAME = 64


def write(program: RobotProgram) -> tuple[ProgramFile, ...]:
    """Return the table of a program of joint angles.

    Raises:
        ProgramError: If its name is none.
    """
    require_name(program.name, LONGEST_NAME, (), "a file")
    timed = program.timed
    time = np.cumsum([0.0, *(move.duration or 0.0 for move in timed[1:])])
    angles = np.array([move.joints for move in timed])
    text = io.StringIO()
    names = ("time", *(f"q{i + 1}" for i in range(angles.shape[1])))
    write_table(text, names, np.column_stack([np.round(time, _DECIMALS), angles]))
    return (ProgramFile(f"{program.name}.csv", text.getvalue()),)


# Of seconds: whole cycles stay whole.
_DECIMALS = 9


def read(text: str, name: str = "") -> RobotProgram:
    """Return the program of a table.

    Raises:
        ProgramError: If it is none.
    """
    where = name or "CSV"
    head, _, body = text.partition("\n")
    names = [word.strip() for word in head.split(",")]
    expected = ["time", *(f"q{i}" for i in range(1, len(names)))]
    if len(names) < 2 or names != expected:
        raise ProgramError(
            f"{where}: expected columns time, q1, q2, .., got {', '.join(names)[:60]}"
        )
    try:
        rows = np.loadtxt(io.StringIO(body), delimiter=",", ndmin=2)
    except ValueError as cause:
        raise ProgramError(f"{where}: is not a table of numbers: {cause}") from cause
    if len(rows) < 2 or rows.shape[1] != len(names) or not np.isfinite(rows).all():
        raise ProgramError(
            f"{where}: expected at least two rows of {len(names)} finite numbers, got {len(rows)}"
        )
    steps = np.diff(rows[:, 0])
    if np.any(steps <= 0.0):
        row = int(np.argmax(steps <= 0.0)) + 2
        raise ProgramError(f"{where}: row {row}: expected rising times, got {rows[row - 1, 0]:g} s")
    moves = [ProgramMove("joint", joints=tuple(rows[0, 1:].tolist()))]
    moves += [
        ProgramMove("spline", joints=tuple(row), duration=float(step))
        for row, step in zip(rows[1:, 1:].tolist(), steps, strict=True)
    ]
    return RobotProgram(where.removesuffix(".csv"), tuple(moves))
