"""The command line: elastic-robot completion."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, Any

import typer

from coupling.cli.shell_scripts import SHELLS, Command, Option
from coupling.errors import CaseError, one_of

_PROGRAM = "elastic-robot"


def _shells() -> list[str]:
    return list(SHELLS)


def completion(
    context: typer.Context,
    shell: Annotated[str, typer.Argument(help="bash, zsh or fish.", autocompletion=_shells)],
) -> None:
    """Print the script that lets a shell complete this command line."""
    if shell not in SHELLS:
        raise CaseError(f"shell: {one_of(SHELLS, shell)}")
    typer.echo(script(context.find_root(), shell), nl=False)


def script(root: Any, shell: str) -> str:
    """Return the script for a shell, from what the program knows of its commands.

    Args:
        root: Context of the whole program, which is a group of commands.
        shell: Name in `SHELLS`.
    """
    group = root.command
    commands = []
    for name in group.list_commands(root):
        found = group.get_command(root, name)
        context = type(root)(found, parent=root, info_name=name)
        arguments = [p for p in found.get_params(context) if p.param_type_name == "argument"]
        words = tuple(word for own in arguments for word in _words(own, context))
        options = tuple(_options(found, context))
        commands.append(Command(name, _line(found.get_short_help_str(limit=200)), options, words))
    return SHELLS[shell](_PROGRAM, tuple(_options(group, root)), commands)


# Typer has its own copy of Click or the one that is installed, by its version: no types of either.
def _options(command: Any, context: Any) -> Iterator[Option]:
    for option in command.get_params(context):
        if option.param_type_name == "option" and not option.hidden:
            names = (*option.opts, *option.secondary_opts)
            takes_value = not (option.is_flag or option.count)
            words = _words(option, context) if takes_value else ()
            yield Option(names, _line(option.help or ""), takes_value, words)


def _words(parameter: Any, context: Any) -> tuple[str, ...]:
    """Return the words that a parameter knows itself; what is a path has none."""
    found = parameter.shell_complete(context, "")
    return tuple(str(item.value) for item in found if item.type == "plain")


def _line(text: str) -> str:
    return " ".join(text.split())
