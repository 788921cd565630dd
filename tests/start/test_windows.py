"""The package where the modules and functions of POSIX systems are not there, as on Windows."""

from __future__ import annotations

import subprocess
import sys
import textwrap

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


def run_without_posix(code: str = "") -> subprocess.CompletedProcess[str]:
    """Load every module without POSIX in a fresh process, and run some code there."""
    script = textwrap.dedent(WITHOUT_POSIX) + textwrap.dedent(code)
    command = [sys.executable, "-c", script]
    return subprocess.run(command, text=True, capture_output=True, timeout=120)


def test_every_module_can_be_imported():
    done = run_without_posix()
    assert done.returncode == 0, done.stderr


def test_what_a_program_of_the_user_needs_is_said_when_one_is_to_run(tmp_path):
    done = run_without_posix(f"""
        from pathlib import Path
        from coupling.errors import ProcessError
        from coupling.process.program import run_program

        folder = Path({str(tmp_path)!r})
        try:
            run_program([sys.executable, "--version"], folder, 60.0)
        except ProcessError as error:
            print(error)
    """)
    assert "a system with groups of processes" in done.stdout, done.stderr
    assert "WSL" in done.stdout
