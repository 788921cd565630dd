"""KUKA KRL, read: a program with its data and the routines that it calls is executed to motions.

Statements that cannot change the path are left out and counted; all others are executed or refused.
"""

from __future__ import annotations

from collections.abc import Sequence

from coupling.errors import ProgramError
from coupling.programs.krl.controller import KrlController
from coupling.programs.krl.execution import Interpreter
from coupling.programs.krl.motions import frame_of
from coupling.programs.krl.syntax import routines_of
from coupling.programs.program import ProgramFile, RobotProgram
from coupling.programs.reading import ReadingNotes


def read(files: Sequence[ProgramFile]) -> RobotProgram:
    """Return the program of a .src, of which the routine of its name, else the first one, is started.

    Components of a target that are left out stay what they were, as on the controller; status and turn
    are not looked at.  PTP to a point without a value, as HOME, may stand before and behind the path.

    Args:
        files: The .src that is started; then those that it calls, and their .dat.

    Raises:
        ProgramError: With the line, what was expected and what was got.

    Example:
        >>> lines = ["DEF WAY()", "$VEL.CP=0.5", "LIN {X 1,Y 2,Z 3,A 0,B 0,C 0}", "END"]
        >>> move = read([ProgramFile("way.src", chr(10).join(lines))]).moves[0]
        >>> move.motion, [round(x, 9) for x in move.pose[:3]], move.speed
        ('linear', [0.001, 0.002, 0.003], 0.5)
    """
    sources = [file for file in files if file.name.lower().endswith(".src")]
    if not sources:
        raise ProgramError(f"program: expected a file .src, got none in {len(files)}")
    routines = [routine for file in sources for routine in routines_of(file)]
    notes = ReadingNotes()
    controller = KrlController(notes)
    interpreter = Interpreter(controller, routines)
    data = [file for file in files if file.name.lower().endswith(".dat")]
    called = {routine.module for routine in routines}
    # What belongs to no program at hand first: the same names of those that are called hold.
    for file in sorted(data, key=lambda file: _module_of(file) in called):
        interpreter.load(file, is_called=_module_of(file) in called)
    name = sources[0].name
    module = _module_of(sources[0])
    main = [routine for routine in routines if routine.module == module]
    main.sort(key=lambda routine: routine.name.upper() != module)
    if main:
        interpreter.run(main[0])
    motions = interpreter.motions.motions
    if not motions.moves:
        raise ProgramError(f"{name}: expected motions, got none")
    values = controller.variables.common.values
    frames = motions.frames
    base = frames.base or frame_of("$BASE", values["$BASE", ()], name)
    tool = frames.tool or frame_of("$TOOL", values["$TOOL", ()], name)
    return RobotProgram(
        main[0].name or name,
        tuple(motions.moves),
        base.pose,
        tool.pose,
        tuple(notes.left_out.items()),
        tuple(notes.assumptions),
    )


def _module_of(file: ProgramFile) -> str:
    return file.name.rsplit(".", 1)[0].upper()
