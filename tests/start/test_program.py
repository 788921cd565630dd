"""The program as a whole: its version, and what a shell completes of it."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest

import elastic_robot
from coupling.cli.console import console

PROGRAM = "import sys; sys.argv[0] = 'elastic-robot'; from coupling.cli import main; main()"


def run(*arguments: str, **environment: str) -> str:
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM, *arguments],
        env={**os.environ, **environment},
        capture_output=True,
        text=True,
        check=True,
    )
    return done.stdout


def test_the_version_is_told():
    assert run("--version") == f"elastic-robot {elastic_robot.__version__}\n"


@pytest.mark.parametrize(
    ("typed", "expected"),
    [
        ("elastic-robot compen", {"compensate"}),
        ("elastic-robot init --robot k", {"kuka_kr210"}),
        ("elastic-robot init --proc", {"--process"}),
        ("elastic-robot check ca", set()),  # files are the shell's own
        ("elastic-robot compensate -o ca", set()),
    ],
)
def test_bash_completes(typed, expected):
    """By the protocol of Typer's script, which falls back on files."""
    said = run(
        COMP_WORDS=typed,
        COMP_CWORD=str(len(typed.split()) - 1),
        _ELASTIC_ROBOT_COMPLETE="complete_bash",
    )
    assert set(said.split()) == expected


def test_what_is_printed_stands_as_it_is():
    text = f"[study] :ok: 'cell[1]/case.toml', {'long ' * 50}"
    with console.capture() as said:
        console.print(text)
    assert said.get() == f"{text}\n"
