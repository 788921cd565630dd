"""--version and the completion of the command line, in real shells where they are installed."""

from __future__ import annotations

import os
import pty
import shutil
import subprocess
import time
from pathlib import Path

import pytest
import typer

import elastic_robot
from coupling.cli import app, main
from coupling.cli.completion import script
from coupling.cli.shell_scripts import SHELLS

# What is typed, and what it can become.
TYPED = [
    ("elastic-robot compen", {"compensate"}),
    ("elastic-robot init --robot k", {"kuka_kr210"}),
    ("elastic-robot init --proc", {"--process"}),
    ("elastic-robot completion z", {"zsh"}),
]


@pytest.fixture(scope="module")
def scripts(tmp_path_factory) -> dict[str, Path]:
    folder, files = tmp_path_factory.mktemp("scripts"), {}
    group = typer.main.get_command(app)
    for shell in SHELLS:
        files[shell] = folder / shell
        files[shell].write_text(
            script(group.make_context("elastic-robot", [], resilient_parsing=True), shell)
        )
    return files


def run(shell: str, program: str, *arguments: str) -> str:
    if shutil.which(shell) is None:
        pytest.skip(f"needs {shell}")
    options = {"bash": ["--norc"], "fish": ["--no-config"]}[shell]
    done = subprocess.run(
        [shell, *options, "-c", program, *arguments], capture_output=True, text=True, check=True
    )
    return done.stdout


@pytest.mark.parametrize(("typed", "expected"), TYPED)
def test_bash_completes(scripts, typed, expected):
    program = (
        f"source {scripts['bash']}; COMP_WORDS=({typed}); COMP_CWORD=$((${{#COMP_WORDS[@]}} - 1));"
        ' $(complete -p elastic-robot | sed "s/.*-F \\([^ ]*\\) .*/\\1/");'
        ' printf "%s\\n" "${COMPREPLY[@]}"'
    )
    program = program.replace("$(complete", 'eval "$(complete').replace('\\1/")', '\\1/")"')
    assert set(run("bash", program).split()) == expected


@pytest.mark.parametrize("typed", ["elastic-robot check ca", "elastic-robot compensate -o ca"])
def test_bash_leaves_files_to_itself(scripts, typed):
    program = (
        f"source {scripts['bash']}; COMP_WORDS=({typed}); COMP_CWORD=$((${{#COMP_WORDS[@]}} - 1));"
        ' _elastic_robot_completion; echo "${#COMPREPLY[@]}"; complete -p elastic-robot'
    )
    count, declared = run("bash", program).splitlines()
    assert count == "0"
    assert "-o default" in declared


@pytest.mark.parametrize(("typed", "expected"), TYPED)
def test_fish_completes(scripts, typed, expected):
    said = run("fish", f"source {scripts['fish']}; complete -C '{typed}'")
    assert {line.split("\t")[0] for line in said.splitlines() if line} == expected


@pytest.mark.skipif(shutil.which("zsh") is None, reason="needs zsh")
def test_zsh_completes(scripts, tmp_path):
    """Typed into a terminal: what the tab key makes of a line is what the program then gets."""
    child, terminal = pty.fork()
    if child == 0:
        os.environ |= {"TERM": "dumb", "HOME": str(tmp_path), "ZDOTDIR": str(tmp_path)}
        os.execvp("zsh", ["zsh", "-f", "-i"])
    got = tmp_path / "got"
    lines = [
        "autoload -U compinit; compinit -u -D; bindkey '^I' complete-word",
        f'elastic-robot() {{ print -r -- "$*" >> {got} }}',
        f"source {scripts['zsh']}",
        *(f"{typed}\t" for typed, _ in TYPED),
        "exit",
    ]
    for line in lines:
        os.write(terminal, f"{line}\n".encode())
        time.sleep(0.15)
    os.waitpid(child, 0)
    os.close(terminal)
    expected = [
        f"{typed.partition(' ')[2].rpartition(' ')[0]} {word}".strip()
        for typed, words in TYPED
        for word in words
    ]
    assert [line.strip() for line in got.read_text().splitlines()] == expected


@pytest.mark.parametrize(
    ("arguments", "status", "said"),
    [
        (["completion", "tcsh"], 2, "expected one of bash, zsh, fish, got 'tcsh'"),
        (["completion", "fish"], 0, "complete -c elastic-robot"),
        (["--version"], 0, f"elastic-robot {elastic_robot.__version__}\n"),
    ],
)
def test_the_command_tells(arguments, status, said, capsys):
    with pytest.raises(SystemExit) as done:
        main(arguments)
    assert done.value.code == status
    told = capsys.readouterr()
    assert said in told.out + told.err
