"""KUKA KRL, written: a spline block whose time is set from point to point, and its list of points.

The words are those of [KukaSI] in docs/references.md.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from coupling.programs.angles import abc_of
from coupling.programs.program import (
    DEGREE_DECIMALS,
    HERE,
    MM_DECIMALS,
    Configuration,
    Pose,
    ProgramFile,
    ProgramMove,
    RobotProgram,
)
from coupling.programs.rounding import round_program, round_single
from coupling.programs.text import format_fixed, numbers, require_lines, require_name

# Characters of a name and of a line that the controller takes.
LONGEST_NAME, LONGEST_LINE = 24, 255
# Decimals of a block's time.
_SECONDS = 6
_RESERVED_WORDS = """
AND ANIN ANOUT AXIS BOOL BRAKE CASE CAST_FROM CAST_TO CHAR CIRC CIRC_REL CONFIRM CONST CONTINUE
DECL DEF DEFAULT DEFDAT DEFFCT DELAY DISTANCE DO E6AXIS E6POS ELSE END ENDDAT ENDFCT ENDFOR
ENDIF ENDLOOP ENDSPLINE ENDSWITCH ENDWHILE ENUM EXIT EXT EXTFCT FALSE FOR FRAME GLOBAL GOTO
HALT IF IMPORT INT INTERRUPT IS LIN LIN_REL LOOP MAXIMUM MINIMUM NOT OFF ON OR POS PRIO PTP
PTP_REL PTP_SPLINE PUBLIC PULSE REAL REPEAT RESUME RETURN SCIRC SEC SIGNAL SLIN SPL SPLINE SPTP
STRUC SWITCH SWRITE SREAD THEN TIME_BLOCK TO TRIGGER TRUE UNTIL WAIT WHEN WHILE WITH
"""
RESERVED = frozenset(_RESERVED_WORDS.split())


def write(program: RobotProgram) -> tuple[ProgramFile, ...]:
    """Return the .src and .dat of a program.

    Its timed motions are a spline block, through poses or of the axes.

    Raises:
        ProgramError: If its name is none for KRL.
    """
    require_name(program.name, LONGEST_NAME, RESERVED, "KRL")
    files = (
        ProgramFile(f"{program.name}.src", "\n".join([*_source(program), ""])),
        ProgramFile(f"{program.name}.dat", "\n".join([*_data(program), ""])),
    )
    for file in files:
        require_lines(file.text, LONGEST_LINE, file.name)
    return files


def rounded(program: RobotProgram) -> RobotProgram:
    """Return a program with the digits that its files have."""
    return round_program(program, round_times=_round_times)


def _round_times(times: np.ndarray) -> np.ndarray:
    percents = (100.0 * times / times.sum()).tolist()
    shares = np.array([float(_share(percent)) for percent in percents], dtype=np.float32)
    rounded_times: np.ndarray = (
        round_single(times.sum(), _SECONDS) * shares.astype(float) / shares.sum(dtype=float)
    )
    return rounded_times


def _source(program: RobotProgram) -> Iterator[str]:
    timed = program.timed
    way = program.moves[: len(program.moves) - len(timed) + 1]
    poses = timed[0].pose is not None
    block, segment = ("SPLINE", "SPL") if poses else ("PTP_SPLINE", "SPTP")
    yield f"DEF {program.name}()"
    yield "; mm, deg; A, B, C turn about Z, Y', X''"
    yield "; $LOAD, the load on the flange, is the controller's: set it before use"
    yield "BAS(#INITMOV,0)"
    yield "BAS(#VEL_PTP,10)"
    for variable, frame in (("$BASE", program.base), ("$TOOL", program.tool)):
        yield f"{variable}={_aggregate(frame or HERE)}"
    yield "$ORI_TYPE=#VAR"
    number = 0
    for move in way:
        if move.speed is not None:
            yield f"$VEL.CP={format_fixed(move.speed, 4)}"
        if move.joints is not None and move is not timed[0]:
            yield f"PTP {_axes(move)}"
            continue
        number += 1
        yield f"{'LIN' if move.pose else 'PTP'} P[{number}]"
    if poses:
        yield f"$VEL.CP={format_fixed(_no_limit(timed), 4)}"
    times = np.array([move.duration for move in timed[1:]], dtype=float)
    total = float(times.sum())
    yield block
    yield "TIME_BLOCK START"
    for k, share in enumerate(100.0 * times / total):
        yield f"{segment} P[{number + 1 + k}]"
        yield f"TIME_BLOCK PART={_share(share)}"
    yield f"TIME_BLOCK END={format_fixed(total, _SECONDS)}"
    yield "ENDSPLINE"
    yield "END"


def _data(program: RobotProgram) -> Iterator[str]:
    timed = program.timed
    poses = timed[0].pose is not None
    yield f"DEFDAT {program.name}"
    configurations = [move.configuration for move in timed]
    kind = ("POS" if all(configurations) else "FRAME") if poses else "AXIS"
    yield f"DECL {kind} P[{len(timed)}]"
    if poses:
        rows = np.array([move.pose for move in timed])
        for k, (position, angles) in enumerate(zip(1e3 * rows[:, :3], abc_of(rows), strict=True)):
            yield f"P[{k + 1}]={_frame(position, angles, configurations[k])}"
    else:
        for k, move in enumerate(timed):
            yield f"P[{k + 1}]={_axes(move)}"
    yield "ENDDAT"


def _aggregate(pose: Pose) -> str:
    row = np.array([pose])
    return _frame(1e3 * row[0, :3], abc_of(row)[0])


def _frame(position: np.ndarray, angles: np.ndarray, posture: Configuration | None = None) -> str:
    values = f"{numbers(position, MM_DECIMALS)},{numbers(angles, DEGREE_DECIMALS)}".split(",")
    fields = [f"{key} {value}" for key, value in zip("XYZABC", values, strict=True)]
    if posture is not None:
        fields += [f"S {posture.status}", f"T {posture.turn}"]
    return "{" + ",".join(fields) + "}"


def _axes(move: ProgramMove) -> str:
    assert move.joints is not None
    angles = numbers(np.rad2deg(move.joints), DEGREE_DECIMALS).split(",")
    return f"{{{','.join(f'A{i} {angle}' for i, angle in enumerate(angles, start=1))}}}"


def _share(percent: float) -> str:
    """Return a share of the time with the digits that a number of the controller holds."""
    return format_fixed(percent, max(0, 8 - math.floor(math.log10(percent))))


def _no_limit(timed: tuple[ProgramMove, ...]) -> float:
    """Return a path speed that is never reached [m/s], so that the time alone counts."""
    rows = np.array([move.pose for move in timed])
    steps = np.linalg.norm(np.diff(rows[:, :3], axis=0), axis=1)
    times = np.array([move.duration for move in timed[1:]], dtype=float)
    return max(0.01, 2.0 * float((steps / times).max()))
