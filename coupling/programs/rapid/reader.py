"""ABB RAPID, read: a program is executed as far as its values are known, and refused where they matter.

Text becomes words (`expressions`), statements and modules (`statements`, of `syntax`). They are executed
(`execution`) on data (`memory`, `values`), whose expressions have values (`evaluation`, `operators`,
`functions`) of which some are known to the controller alone; motions are collected on the way
(`motion_statements`, `motions`). What is left out or refused stands in `harmless`.
"""

from __future__ import annotations

from collections.abc import Mapping

from coupling.errors import ProgramError
from coupling.programs.program import RobotProgram
from coupling.programs.rapid.entry import entry_of
from coupling.programs.rapid.execution import RapidExecution
from coupling.programs.rapid.statements import modules_of


def read(text: str, name: str = "", others: Mapping[str, str] | None = None) -> RobotProgram:
    r"""Return the program of a module: what its `main` executes, or its only procedure with motions.

    A speed counts where no time `\T` is given.

    Args:
        text: Text of the .mod or .prg.
        name: Name of the file, for messages.
        others: Texts of other modules by file names: data and routines that the file lacks are theirs.

    Raises:
        ProgramError: With the line, what was expected and what was got.

    Example:
        >>> text = "MoveL [[1,2,3],[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v100\\T:=0.5,z0,tool0;"
        >>> move = read(text).moves[0]
        >>> move.motion, [round(x, 9) for x in move.pose[:3]], move.duration
        ('linear', [0.001, 0.002, 0.003], 0.5)
    """
    file = name or "RAPID"
    try:
        return _execute(text, file, others or {})
    except RecursionError:
        raise ProgramError(
            f"{file}: expected routines and statements less deep in each other, got more than can be"
            " executed"
        ) from None


def _execute(text: str, file: str, others: Mapping[str, str]) -> RobotProgram:
    modules = modules_of(text, file)
    execution = RapidExecution.of(modules, others)
    routine, module = entry_of(modules, execution.notes, file)
    execution.run(routine, module)
    motions = execution.motions
    if not motions.moves:
        raise ProgramError(f"{file}: expected motions, got none")
    return RobotProgram(
        routine.name or file,
        tuple(motions.moves),
        motions.base,
        motions.tool,
        tuple(execution.notes.left_out.items()),
        tuple(execution.notes.assumptions),
    )
