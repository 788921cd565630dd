"""The program as a whole: how little it loads, help, version, and what a shell completes of it."""

import os
import signal
import subprocess
import sys

import pytest
import typer
from places import EXAMPLES
from typer.testing import CliRunner

import elastic_robot
from coupling.cli import app, main
from coupling.cli.console import console
from coupling.export.exported_program import TOLERANCE
from coupling.identification.next.options import KINDS
from coupling.programs.languages import LANGUAGES
from coupling.robot.robot_fmu import DEFAULT_KIND
from elastic_robot.fmi.interface import MODEL_NAME

COMMANDS = typer.main.get_command(app).commands
HEAVY = {
    *("elastic_robot", "numpy", "scipy", "pinocchio", "pydantic", "fmpy", "pythonfmu", "plotly"),
    *("piqp", "filelock", "tomli_w", "numba", "pandas", "distributed"),
}
PROGRAM = "import sys; sys.argv[0] = 'elastic-robot'; from coupling.cli import main; main()"
LIBRARIES = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS")
# Tells what stands in the environment at the moment at which NumPy is looked for.
WATCHED = f"""
import os, sys

class Finder:
    def find_spec(self, name, path=None, target=None):
        if name == "numpy":
            print(*(os.environ.get(library, "none") for library in {LIBRARIES!r}))

sys.meta_path.insert(0, Finder())
import coupling.cli
import numpy
"""


def run(*arguments: str, **environment: str) -> str:
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM, *arguments],
        env={**os.environ, **environment},
        capture_output=True,
        text=True,
        check=True,
    )
    return done.stdout


def loaded_modules(*arguments: str) -> set[str]:
    program = [sys.executable, "-X", "importtime", "-c", PROGRAM, *arguments]
    done = subprocess.run(program, capture_output=True, text=True, check=True)
    return {line.rpartition("|")[2].strip() for line in done.stderr.splitlines()}


@pytest.mark.parametrize(("command", "of_typer"), [([], set()), (["study"], {"pydantic"})])
def test_help_loads_neither_the_model_nor_what_computes(command, of_typer):
    """Typer itself checks ranges of options with pydantic."""
    loaded = loaded_modules(*command, "--help")
    assert "coupling.cli.study" in loaded
    assert {name.partition(".")[0] for name in loaded} & HEAVY <= of_typer


def test_the_list_of_robots_loads_no_scipy():
    """It takes longer to load than all else together."""
    loaded = loaded_modules("robots")
    assert "coupling.files.robot_file" in loaded
    assert "scipy" not in loaded


@pytest.mark.parametrize("name", COMMANDS)
def test_help_says_every_word_of_its_source(name):
    """Brackets too, as of [study] and [mm], which Rich takes for markup."""
    shown = CliRunner().invoke(app, [name, "--help"], env={"COLUMNS": "500"}).stdout
    listed = CliRunner().invoke(app, ["--help"], env={"COLUMNS": "500"}).stdout
    assert COMMANDS[name].help in listed
    for told in (COMMANDS[name], *COMMANDS[name].params):
        assert " ".join(told.help.split()) in shown


def test_help_may_be_asked_for_again(command):
    """The commands are made once in a process, and what help makes of their words does not stay."""
    for arguments in (["study", "--help"], ["--help"]):
        first, again = (command(*arguments).stdout for _ in range(2))
        assert first == again
        assert "[study]" in first or arguments == ["--help"]


def test_help_names_what_there_is():
    """What a command says of the model is written twice: help does not load the model."""
    told = {name: {own.name: own for own in COMMANDS[name].params} for name in COMMANDS}
    assert ", ".join(LANGUAGES) in told["export"]["to"].help
    assert ", ".join(KINDS) in told["next"]["move"].help
    assert told["export"]["tolerance"].default == 1e6 * TOLERANCE
    assert (told["build"]["kind"].default, told["build"]["name"].default) == (
        DEFAULT_KIND,
        MODEL_NAME,
    )


def test_the_version_is_told():
    assert run("--version") == f"elastic-robot {elastic_robot.__version__}\n"


@pytest.mark.parametrize(
    ("typed", "expected"),
    [
        ("elastic-robot compen", {"compensate"}),
        ("elastic-robot init --robot k", {"kuka_kr210", "kuka_kr300"}),
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


@pytest.mark.parametrize("module", ["typer", "coupling.cli.runs", "rich.markup"])
def test_an_interrupt_while_the_commands_are_imported_is_quiet(module):
    """An interrupt by hand at the moment at which a module is looked for."""
    program = (
        "import os, signal, sys\n"
        "class Hand:\n"
        "    def find_spec(self, name, path=None, target=None):\n"
        f"        if name == {module!r}:\n"
        "            os.kill(os.getpid(), signal.SIGINT)\n"
        "sys.meta_path.insert(0, Hand())\n"
        f"{PROGRAM}"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)
    assert (done.returncode, done.stdout, done.stderr) == (130, "", "")


def test_an_interrupt_while_arguments_are_read_says_that_nothing_was_written(monkeypatch):
    def interrupted(*_: object, **__: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("typer.core.TyperGroup.make_context", interrupted)
    with pytest.raises(SystemExit) as ended:
        main(["robots"])
    assert ended.value.code == 130
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_what_is_printed_stands_as_it_is():
    text = f"[study] :ok: 'cell[1]/case.toml', {'long ' * 50}"
    with console.capture() as said:
        console.print(text)
    assert said.get() == f"{text}\n"


def test_a_reader_that_goes_costs_no_file(tmp_path):
    """As `| head` does: nothing more is printed, and the robot file is written."""
    measured, target = EXAMPLES / "identify" / "fanuc_r2000ic", tmp_path / "found.toml"
    typed = [f"{measured}.csv", "--robot", measured.with_name("fanuc_start.toml"), "-o", target]
    read, write = os.pipe()
    os.close(read)
    program = [sys.executable, "-m", "coupling.cli", "identify", *map(str, typed)]
    done = subprocess.run(program, stdout=write, stderr=subprocess.PIPE, text=True, check=False)
    os.close(write)
    assert (done.returncode, done.stderr) == (0, "")
    assert target.exists()


@pytest.mark.parametrize("wanted", [None, "3"])
def test_threads_are_limited_before_numpy_is_loaded_unless_the_user_says_how_many(wanted):
    environment = {name: value for name, value in os.environ.items() if name not in LIBRARIES}
    if wanted is not None:
        environment |= dict.fromkeys(LIBRARIES, wanted)
    done = subprocess.run(
        [sys.executable, "-c", WATCHED], env=environment, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.split() == [wanted or "1"] * 3
