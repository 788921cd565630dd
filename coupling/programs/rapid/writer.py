"""ABB RAPID, written: a module of timed motions, with tool and work object.

The words are those of [ABBRapid] in docs/references.md.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import partial

import numpy as np

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
from coupling.programs.rounding import round_program, round_quaternions, round_single
from coupling.programs.text import format_fixed, numbers, require_lines, require_name

# Characters of a name, and of a line that the editor of the pendant shows whole.
LONGEST_NAME, LONGEST_LINE = 32, 80
_RESERVED_WORDS = """
ALIAS AND BACKWARD CASE CONNECT CONST DEFAULT DIV DO ELSE ELSEIF ENDFOR ENDFUNC ENDIF ENDMODULE
ENDPROC ENDRECORD ENDTEST ENDTRAP ENDWHILE ERROR EXIT FALSE FOR FROM FUNC GOTO IF INOUT LOCAL
MOD MODULE NOSTEPIN NOT NOVIEW OR PERS PROC RAISE READONLY RECORD RETRY RETURN STEP SYSMODULE
TASK TEST THEN TO TRAP TRUE TRYNEXT UNDO VAR VIEWONLY WHILE WITH XOR MAIN
"""
RESERVED = frozenset(_RESERVED_WORDS.split())
# Decimals: 0.1 urad in a quaternion; seconds.
_QUATERNION, _SECONDS = 8, 6
_EXTERNAL = "[9E9,9E9,9E9,9E9,9E9,9E9]"
# Characters that follow the program's name in those of its data.
_MARK = 2


def write(program: RobotProgram) -> tuple[ProgramFile, ...]:
    r"""Return the module of a program.

    Its timed motions are `MoveL` or `MoveAbsJ`, their times in `\T`, through a fly-by zone of 0.3 mm.

    Raises:
        ProgramError: If its name is none for RAPID.
    """
    require_name(program.name, LONGEST_NAME - _MARK, RESERVED, "RAPID")
    file = ProgramFile(f"{program.name}.mod", "\n".join([*_module(program), ""]))
    require_lines(file.text, LONGEST_LINE, file.name)
    return (file,)


def rounded(program: RobotProgram) -> RobotProgram:
    """Return a program with the digits that its module has."""
    return round_program(
        program,
        partial(round_quaternions, decimals=_QUATERNION),
        partial(round_single, decimals=_SECONDS),
    )


def _module(program: RobotProgram) -> Iterator[str]:
    name = program.name
    yield f"MODULE M_{name}"
    yield "  ! mm, quaternions w first; set the load of the tool before use"
    yield f"  PERS tooldata t_{name}:=[TRUE,"
    yield from _frame(program.tool or HERE)
    yield "    [1,[0,0,0.001],[1,0,0,0],0,0,0]];"
    yield f'  PERS wobjdata w_{name}:=[FALSE,TRUE,"",'
    yield from _frame(program.base or HERE)
    yield "    [[0,0,0],[1,0,0,0]]];"
    yield f"  PROC {name}()"
    yield "    ConfL\\Off;"
    frames = f"t_{name}\\WObj:=w_{name};"
    timed = program.timed
    way = program.moves[: len(program.moves) - len(timed) + 1]
    for move in way:
        speed = 1e3 * (0.05 if move.speed is None else move.speed)
        yield from _move(move, f"[{format_fixed(speed, 3)},500,5000,1000],fine,", frames)
    for k, move in enumerate(timed[1:], start=2):
        assert move.duration is not None
        zone = "fine" if k == len(timed) else "z0"
        yield from _move(move, f"v100\\T:={format_fixed(move.duration, _SECONDS)},{zone},", frames)
    yield "  ENDPROC"
    yield "ENDMODULE"


def _move(move: ProgramMove, how: str, frames: str) -> Sequence[str]:
    if move.joints is not None:
        angles = numbers(np.rad2deg(move.joints), DEGREE_DECIMALS)
        target: tuple[str, ...] = (f"    MoveAbsJ [[{angles}],", f"      {_EXTERNAL}]\\NoEOffs,")
    else:
        assert move.pose is not None
        word = "MoveL" if move.motion == "linear" else "MoveJ"
        position, quaternion = _parts(move.pose)
        target = (
            f"    {word} [{position},",
            f"      {quaternion},{_configuration(move.configuration)},",
            f"      {_EXTERNAL}],",
        )
    return (*target, f"      {how}", f"      {frames}")


def _frame(pose: Pose) -> Iterator[str]:
    position, quaternion = _parts(pose)
    yield f"    [{position},"
    yield f"      {quaternion}],"


def _parts(pose: Pose) -> tuple[str, str]:
    """Return position and quaternion of a pose."""
    x, y, z, w = pose[3:]
    position = numbers(1e3 * np.array(pose[:3]), MM_DECIMALS)
    return f"[{position}]", f"[{numbers((w, x, y, z), _QUATERNION)}]"


def _configuration(configuration: Configuration | None) -> str:
    if configuration is None:
        return "[0,0,0,0]"
    axis_1, axis_4, axis_6 = configuration.quadrants
    return f"[{axis_1},{axis_4},{axis_6},{_cfx(configuration)}]"


def _cfx(configuration: Configuration) -> int:
    """Return the number of a posture: behind axis 1, behind the lower arm, joint 5 negative."""
    return 4 * configuration.behind + 2 * configuration.below + (configuration.wrist < 0)
