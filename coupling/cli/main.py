"""All commands as one program, and what it says where one of them fails.

Every call loads the modules of all commands, `--help` and a shell's completion among them. What they
import at their top, and what annotations and defaults of a command name, is therefore light: typer,
rich, `coupling.errors`, `coupling.events`. The model and the rest of `coupling`, which need NumPy, are
imported in the functions that use them.
"""

from __future__ import annotations

import functools
import gc
import os
import shlex
import signal
import sys
import threading
import traceback
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from types import FrameType
from typing import Annotated, Any

import typer
from rich.markup import escape
from typer.core import TyperCommand, TyperGroup

from coupling.cli import (
    build,
    check,
    compare,
    export,
    identify,
    init,
    modes,
    place,
    robots,
    runs,
    stability,
    store,
    study,
)
from coupling.cli import next as next_
from coupling.cli.console import errors
from coupling.cli.runs import BAD_INPUT
from coupling.cli.streams import lasting_streams
from coupling.errors import CouplingError, reason_of

DEBUG = "--debug"
INTERRUPTED = 130
# New objects until garbage is looked for: with the 700 that Python has, imports and reports take a tenth
# longer.
_NEW_OBJECTS = 50_000
_PACKAGE = Path(__file__).parents[1]
_REPORT = "please report it, with what the same command shows with --debug"


class _StoppedError(Exception):
    """The user has interrupted a command: typer would swallow a KeyboardInterrupt with its notes."""


@contextmanager
def _stop_on_signals() -> Iterator[None]:
    try:
        yield
    except KeyboardInterrupt as stop:
        raise _StoppedError from stop


class _AsItStands(str):
    """Help without markup of Rich."""


def _as_text(*entries: Any) -> None:
    """Let the help of commands and parameters stand as it is: [study] is a table, no markup of Rich."""
    for entry in entries:
        if not isinstance(entry.help, _AsItStands):
            entry.help = _AsItStands(escape(entry.help or ""))


class _Command(TyperCommand):
    def format_help(self, ctx: Any, formatter: Any) -> None:
        _as_text(self, *self.params)
        super().format_help(ctx, formatter)


class _Commands(TyperGroup):
    def format_help(self, ctx: Any, formatter: Any) -> None:
        _as_text(self, *self.params, *self.commands.values())
        super().format_help(ctx, formatter)

    def make_context(self, *values: Any, **options: Any) -> Any:
        with _stop_on_signals():
            return super().make_context(*values, **options)

    def invoke(self, ctx: Any) -> Any:
        with _stop_on_signals():
            return super().invoke(ctx)


app = typer.Typer(
    cls=_Commands,
    no_args_is_help=True,
    pretty_exceptions_enable=False,
)
_COMMANDS = (
    init.init,
    check.check,
    modes.modes,
    build.build,
    build.ssp,
    runs.couple,
    runs.compensate,
    export.export,
    study.study,
    place.place,
    runs.report,
    stability.stability,
    compare.compare,
    store.store,
    identify.identify,
    next_.learn,
    next_.mirror,
    robots.robots,
)
for _command in _COMMANDS:
    app.command(cls=_Command)(_command)
app.command("next", cls=_Command)(next_.next_command)


def _print_version(is_asked: bool) -> None:
    if is_asked:
        import elastic_robot

        typer.echo(f"elastic-robot {elastic_robot.__version__}")
        raise typer.Exit


@app.callback()
def _program(
    version: Annotated[
        bool,
        typer.Option(
            "--version", callback=_print_version, is_eager=True, help="Print the version."
        ),
    ] = False,
    debug: Annotated[
        bool,
        typer.Option(DEBUG, help="Show where in the program an error arose; stands at any place."),
    ] = False,
) -> None:
    """Elastic robot: build its FMU, couple it with a process, compensate its path."""


@functools.cache
def _whole() -> Any:
    """Return all commands as one, made once in a process: that takes as long as a quick command."""
    return typer.main.get_command(app)


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command line; exit status 0 converged, 1 not converged, 2 bad input, 130 stopped."""
    words = list(sys.argv[1:] if arguments is None else arguments)
    shows_trace = DEBUG in words
    gc.set_threshold(_NEW_OBJECTS, *gc.get_threshold()[1:])
    with lasting_streams() as output, termination_interrupts():
        try:
            try:
                _whole()([word for word in words if word != DEBUG])
            finally:
                output.flush()
        except (KeyboardInterrupt, _StoppedError) as stop:
            notes = _notes(stop.__cause__ or stop) or ["nothing was written"]
            if words:
                command = shlex.join(["elastic-robot", *words])
                notes.append(f"to go on, or to begin anew: {command}")
            text = "\n".join([f"stopped; {notes[0]}", *notes[1:]])
            errors.print(text)
            sys.exit(INTERRUPTED)
        except SystemExit as end:
            if output.failure is not None and not end.code:
                reason = reason_of(output.failure)
                text = (
                    f"error: standard output: cannot be written: {reason}: what files hold is whole"
                )
                errors.print(text, style="red")
                sys.exit(BAD_INPUT)
            raise
        except Exception as error:
            if shows_trace:
                errors.print("".join(traceback.format_exception(error)).rstrip())
            text = "\n".join([f"error: {describe_failure(error)}", *_notes(error)])
            errors.print(text, style="red")
            sys.exit(BAD_INPUT)


def _notes(error: BaseException) -> list[str]:
    """Return what was added to an error on its way here."""
    return list(getattr(error, "__notes__", []))


@contextmanager
def termination_interrupts() -> Iterator[None]:
    """Let SIGTERM and SIGHUP be as orderly as Ctrl-C; only a process's main thread can.

    SIGHUP stays ignored where it is, as under nohup.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    numbers = [getattr(signal, name) for name in ("SIGTERM", "SIGHUP") if hasattr(signal, name)]
    before = {number: signal.getsignal(number) for number in numbers}
    for number, handler in before.items():
        if handler is not signal.SIG_IGN:
            signal.signal(number, _interrupt)
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def _interrupt(number: int, frame: FrameType | None) -> None:
    raise KeyboardInterrupt


def describe_failure(error: Exception) -> str:
    """Return one sentence for an exception.

    Errors of this package tell the user what to do.  Others are the machine's, such as a full disk, or
    this program's own faults, which the sentence calls so.

    Example:
        >>> describe_failure(FileNotFoundError(2, "No such file or directory", "line.toml"))
        'line.toml: No such file or directory'
        >>> describe_failure(ZeroDivisionError("float division by zero"))[:71]
        'a fault of this program (ZeroDivisionError: float division by zero): pl'
    """
    from elastic_robot.errors import ElasticRobotError

    match error:
        case CouplingError() | ElasticRobotError():
            return str(error)
        case OSError():
            return _of_the_system(error)
        case MemoryError():
            return (
                "expected more memory than this machine has left: end other programs, or take a"
                " shorter path or fewer samples" + (f" ({error})" if str(error) else "")
            )
        case UnicodeEncodeError():
            return (
                f"expected a system whose encoding has {error.object[error.start]!a}, got"
                f" {error.encoding}: set PYTHONUTF8=1"
            )
        case RecursionError():
            return (
                f"expected a file that is nested less deeply, got too many levels{_where(error)}: if"
                f" it is not nested, {_REPORT}"
            )
    words = f"{type(error).__name__}: {error}".removesuffix(": ")
    return f"a fault of this program ({words}{_where(error)}): {_REPORT}"


def _of_the_system(error: OSError) -> str:
    """Return which file or resource the system refuses, and why."""
    try:
        os.getcwd()
    except OSError:
        return "the working folder is no longer there: change to one that is"
    names = [os.fsdecode(name) for name in (error.filename, error.filename2) if name is not None]
    if names:
        return f"{' to '.join(names)}: {reason_of(error)}"
    return (
        f"the system refused what was asked of it: {type(error).__name__}: {error}{_where(error)}"
    )


def _where(error: BaseException) -> str:
    """Return the last line of this package that an exception came through."""
    frames = [
        frame
        for frame in traceback.extract_tb(error.__traceback__)
        if Path(frame.filename).is_relative_to(_PACKAGE)
    ]
    return f", {os.path.basename(frames[-1].filename)} line {frames[-1].lineno}" if frames else ""
