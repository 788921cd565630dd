"""Running a user's code: whatever ends it is an error, even what would end the whole command."""

from __future__ import annotations

import importlib.util
import inspect
import os
import sys
import traceback
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from types import ModuleType
from typing import NoReturn

from coupling.errors import CaseError, CouplingError, one_of
from coupling.process import PROCESSES
from coupling.process.base import ProcessSchema


@contextmanager
def authors_code(said: Callable[[str], CouplingError]) -> Iterator[None]:
    """Turn what ends a user's code into an error.

    That includes `sys.exit` and `os._exit`, by which a command would end with the status of a result
    that it has not; processes that the code has forked end by them as ever.  The `exit` of a library in
    C cannot be caught.

    Args:
        said: Returns the error for what happened, with its line in the code.

    Example:
        >>> try:
        ...     with authors_code(lambda what: CouplingError(f"mine: {what}")):
        ...         os._exit(0)
        ... except CouplingError as error:
        ...     print(str(error).partition(" (")[0])
        mine: SystemExit: 0
    """
    process, end = os.getpid(), os._exit

    def end_code(status: int) -> NoReturn:
        if os.getpid() != process:
            end(status)
        raise SystemExit(status)

    os._exit = end_code
    try:
        yield
    except (CouplingError, KeyboardInterrupt):
        raise
    except BaseException as cause:
        lines = [
            line
            for line in traceback.extract_tb(cause.__traceback__)
            if line.filename != __file__ and not line.filename.startswith("<frozen importlib")
        ]
        where = f" ({Path(lines[-1].filename).name}, line {lines[-1].lineno})" if lines else ""
        raise said(f"{type(cause).__name__}: {cause}{where}") from cause
    finally:
        os._exit = end


def find_process(model: str, folder: Path) -> tuple[str, type[ProcessSchema]]:
    """Return a model's full name and its table.

    Args:
        model: "isf-force-law" and the like, or "my_process.py:MyTable".
        folder: Folder in which relative files begin.

    Raises:
        CaseError: If there is none of that name, or its file cannot be imported.
    """
    if model in PROCESSES:
        return model, PROCESSES[model]
    name, separator, table = model.partition(".py:")
    if not separator:
        raise CaseError(
            one_of(
                PROCESSES, model, also=" or a class in a file of your own (my_process.py:MyTable)"
            )
        )
    file = (folder / f"{name}.py").resolve()
    if not file.is_file():
        raise CaseError(f"expected the Python file of the process, got {file}, which is not there")
    module = _import_file(file)
    schema = getattr(module, table, None)
    is_table = isinstance(schema, type) and issubclass(schema, ProcessSchema)
    if schema is None or not is_table or inspect.isabstract(schema):
        raise CaseError(
            f"{file}: expected a class {table} derived from elastic_robot.coupling.process.ProcessTable,"
            f" with a method process(task), got {'none' if schema is None else schema}"
        )
    return f"{file}:{table}", schema


def _import_file(file: Path) -> ModuleType:
    name = f"own_process_{file.stem}"
    spec = importlib.util.spec_from_file_location(name, file)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module  # dataclasses look their module up by name
    with authors_code(lambda what: CaseError(f"{file}: cannot be imported: {what}")):
        spec.loader.exec_module(module)
    return module
