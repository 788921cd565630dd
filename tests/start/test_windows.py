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


def test_every_module_is_imported_and_what_a_users_program_needs_is_said(tmp_path):
    script = textwrap.dedent(WITHOUT_POSIX) + textwrap.dedent(PROGRAM)
    command = [sys.executable, "-c", script, str(tmp_path)]
    done = subprocess.run(command, text=True, capture_output=True, timeout=120)
    assert done.returncode == 0, done.stderr
    assert "a system with groups of processes" in done.stdout
    assert "WSL" in done.stdout
