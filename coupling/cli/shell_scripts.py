"""Completion scripts of bash, zsh and fish for a program with commands; the scripts hold all words."""

from __future__ import annotations

import shlex
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass


@dataclass(frozen=True)
class Option:
    """An option of a command.

    Attributes:
        names: Its spellings, such as -o and --output.
        about: What it does, in one line.
        takes_value: Whether a word follows it.
        values: Words that may follow; empty: any, and files are offered.
    """

    names: tuple[str, ...]
    about: str
    takes_value: bool
    values: tuple[str, ...] = ()


@dataclass(frozen=True)
class Command:
    """A command of a program.

    Attributes:
        name: Its name.
        about: What it does, in one line.
        options: Its options.
        values: Words for its arguments; empty: any, and files are offered.
    """

    name: str
    about: str
    options: tuple[Option, ...]
    values: tuple[str, ...] = ()

    @property
    def words(self) -> list[str]:
        """All spellings of its options."""
        return [name for option in self.options for name in option.names]


def bash_script(program: str, own: Sequence[Option], commands: Sequence[Command]) -> str:
    """Return a script for bash.

    Args:
        program: Name of the program.
        own: Options before the command.
        commands: Its commands.
    """
    function = f"_{program.replace('-', '_')}_completion"
    first = " ".join([command.name for command in commands] + _names(own))
    lines = [
        f"{function}() {{",
        '    local word="${COMP_WORDS[COMP_CWORD]}" before="${COMP_WORDS[COMP_CWORD-1]}" words=""',
        "    COMPREPLY=()",
        '    if [ "$COMP_CWORD" -eq 1 ]; then',
        f"        words={shlex.quote(first)}",
        "    else",
        '        case "${COMP_WORDS[1]} $before" in',
    ]
    for command in commands:
        for option in command.options:
            if not option.takes_value:
                continue
            patterns = "|".join(f'"{command.name} {name}"' for name in option.names)
            said = f"words={shlex.quote(' '.join(option.values))}" if option.values else "return"
            lines.append(f"            {patterns}) {said} ;;")
    lines.append('            *) case "${COMP_WORDS[1]}" in')
    for command in commands:
        words = shlex.quote(" ".join(command.values))
        if command.words:
            options = shlex.quote(" ".join(command.words))
            choice = f'if [ "${{word:0:1}}" = - ]; then words={options}; else words={words}; fi'
        else:
            choice = f"words={words}"
        lines.append(f"                {command.name}) {choice} ;;")
    lines += [
        "            esac ;;",
        "        esac",
        "    fi",
        "    local each",
        "    for each in $words; do",
        '        case "$each" in "$word"*) COMPREPLY+=("$each") ;; esac',
        "    done",
        "}",
        f"complete -o bashdefault -o default -F {function} {program}",
    ]
    return "\n".join(lines) + "\n"


def zsh_script(program: str, own: Sequence[Option], commands: Sequence[Command]) -> str:
    """Return a script for zsh; as for bash."""
    function = f"_{program.replace('-', '_')}"
    described = " ".join(_described(command.name, command.about) for command in commands)
    lines = [
        f"#compdef {program}",
        f"{function}() {{",
        "    if (( CURRENT == 2 )); then",
        f"        local -a commands=({described})",
        "        _describe command commands",
        f"        _arguments {' '.join(_zsh_options(own))}",
        "        return",
        "    fi",
        "    local chosen=$words[2]",
        '    words=("$words[1]" "${(@)words[3,-1]}")',
        "    (( CURRENT -= 1 ))",
        "    case $chosen in",
    ]
    for command in commands:
        rest = f"*:value:({' '.join(command.values)})" if command.values else "*:file:_files"
        specs = [*_zsh_options(command.options), shlex.quote(rest)]
        lines.append(f"        {command.name}) _arguments {' '.join(specs)} ;;")
    lines += ["    esac", "}", f"compdef {function} {program}"]
    return "\n".join(lines) + "\n"


def fish_script(program: str, own: Sequence[Option], commands: Sequence[Command]) -> str:
    """Return a script for fish; as for bash."""
    start = f"complete -c {program}"
    lines = [
        f"{start} -n __fish_use_subcommand -f -a {shlex.quote(command.name)}"
        f" -d {shlex.quote(command.about)}"
        for command in commands
    ]
    lines += [f"{start} -n __fish_use_subcommand {_fish(option)}" for option in own]
    for command in commands:
        seen = shlex.quote(f"__fish_seen_subcommand_from {command.name}")
        lines += [f"{start} -n {seen} {_fish(option)}" for option in command.options]
        if command.values:
            lines.append(f"{start} -n {seen} -f -a {shlex.quote(' '.join(command.values))}")
    return "\n".join(lines) + "\n"


def _names(options: Sequence[Option]) -> list[str]:
    return [name for option in options for name in option.names]


def _described(name: str, about: str) -> str:
    return shlex.quote(f"{name}:{about}")


def _zsh_options(options: Sequence[Option]) -> Iterator[str]:
    for option in options:
        about = "".join(f"\\{c}" if c in "[]:\\" else c for c in option.about)
        value = f":value:({' '.join(option.values)})" if option.values else ":value:_files"
        for name in option.names:
            yield shlex.quote(f"{name}[{about}]{value if option.takes_value else ''}")


def _fish(option: Option) -> str:
    parts = [
        f"-l {name.removeprefix('--')}" if name.startswith("--") else f"-s {name.removeprefix('-')}"
        for name in option.names
    ]
    if option.takes_value:
        parts.append("-r")
    if option.values:
        parts.append(f"-f -a {shlex.quote(' '.join(option.values))}")
    return " ".join([*parts, "-d", shlex.quote(option.about)])


SHELLS: dict[str, Callable[[str, Sequence[Option], Sequence[Command]], str]] = {
    "bash": bash_script,
    "zsh": zsh_script,
    "fish": fish_script,
}
