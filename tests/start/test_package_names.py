"""`elastic_robot.coupling` in a checkout, loaded once under both names, and without modules of POSIX."""

import importlib
import pickle
import subprocess
import sys
import textwrap
from pathlib import Path

import pytest

import coupling
import elastic_robot.coupling
from coupling.path.frame import Frame

# Run once as usual, so that other packages have what they want of this system; then ours alone anew.
WITHOUT_POSIX = """
    import importlib, os, pkgutil, signal, sys

    def load_all():
        for package in ("elastic_robot", "coupling"):
            folders = importlib.import_module(package).__path__
            for module in pkgutil.walk_packages(folders, f"{package}."):
                if not module.name.endswith(("__main__", "worker_main")):
                    importlib.import_module(module.name)

    load_all()
    for name in [n for n in sys.modules if n.partition(".")[0] in ("elastic_robot", "coupling")]:
        del sys.modules[name]
    POSIX = "fcntl grp posix pty pwd readline resource syslog termios tty"
    sys.modules |= dict.fromkeys(POSIX.split())
    for name in (
        "fork forkpty getgid getloadavg getpgid getuid geteuid killpg mkfifo nice posix_fallocate"
        " posix_spawn register_at_fork sched_getaffinity setsid statvfs sysconf uname wait3 wait4"
    ).split():
        if hasattr(os, name):
            delattr(os, name)
    for name in "SIGALRM SIGCHLD SIGHUP SIGKILL SIGPIPE SIGUSR1 alarm setitimer".split():
        if hasattr(signal, name):
            delattr(signal, name)
    load_all()
"""
# A program of the user's cannot be ended with what it has started.
PROGRAM = """
    from pathlib import Path
    from coupling.errors import ProcessError
    from coupling.process.program import run_program

    try:
        run_program([sys.executable, "--version"], Path(sys.argv[1]), 60.0)
    except ProcessError as error:
        print(error)
"""


def test_every_module_is_the_same_by_both_names():
    """Imported in a fresh process by the long name first, as users do."""
    done = run("""
import importlib, pkgutil, sys
import elastic_robot.coupling
for module in pkgutil.walk_packages(elastic_robot.coupling.__path__, "elastic_robot.coupling."):
    if "__main__" not in module.name:
        assert importlib.import_module(module.name).__name__ == module.name[len("elastic_robot."):]
for name, module in list(sys.modules.items()):
    if name.startswith("elastic_robot.coupling"):
        assert module is sys.modules[name.removeprefix("elastic_robot.")], name
""")
    assert done.returncode == 0, done.stderr


def test_instances_and_pickles_are_of_one_class():
    from elastic_robot.coupling.path.frame import Frame as LongFrame

    assert LongFrame is Frame
    frame = LongFrame.of_rpy([1.0, 2.0, 3.0], [0.0, 0.0, 0.0])
    installed = pickle.dumps(frame, protocol=0).replace(
        b"ccoupling.path", b"celastic_robot.coupling.path"
    )
    assert b"elastic_robot.coupling" in installed  # as a wheel writes it
    for pickled in (pickle.dumps(frame), installed):
        assert isinstance(pickle.loads(pickled), Frame)


def test_a_module_keeps_its_spec():
    module = importlib.import_module("elastic_robot.coupling.files.toml_file")
    assert module.__spec__.name == module.__name__ == "coupling.files.toml_file"
    assert elastic_robot.coupling is coupling


def test_a_module_that_is_not_there_is_not_found():
    assert importlib.util.find_spec("elastic_robot.coupling.nothing") is None
    with pytest.raises(ModuleNotFoundError, match=r"elastic_robot\.coupling\.nothing"):
        importlib.import_module("elastic_robot.coupling.nothing")


def test_python_runs_its_modules():
    command = [sys.executable, "-m", "elastic_robot.coupling.cli", "--version"]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.stdout.startswith("elastic-robot "), done.stderr


def test_a_file_that_python_finds_in_place_of_the_folder_is_named(tmp_path):
    (tmp_path / "coupling.py").write_text("")
    done = run("import elastic_robot.coupling", tmp_path)
    last = done.stderr.splitlines()[-1]
    assert last.startswith(f"ImportError: coupling: expected {coupling.__file__}, got {tmp_path}")
    assert "rename or uninstall that, or install the wheel" in last


def test_the_desk_side_is_no_part_of_the_model():
    from elastic_robot.fingerprint import model_files

    package = Path(elastic_robot.__file__).parent
    names = {file.name for file in model_files(package)}
    assert "robot.py" in names
    assert "coupling.py" not in names
    assert (package / "coupling.py").is_file()


def run(code: str, folder: Path | None = None) -> subprocess.CompletedProcess[str]:
    return subprocess.run([sys.executable, "-c", code], cwd=folder, capture_output=True, text=True)


def test_every_module_is_imported_and_what_a_users_program_needs_is_said(tmp_path):
    script = textwrap.dedent(WITHOUT_POSIX) + textwrap.dedent(PROGRAM)
    command = [sys.executable, "-c", script, str(tmp_path)]
    done = subprocess.run(command, text=True, capture_output=True, timeout=120)
    assert done.returncode == 0, done.stderr
    assert "a system with groups of processes" in done.stdout
    assert "WSL" in done.stdout
