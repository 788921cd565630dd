"""Write the times of docs/tutorial.md: from an empty folder to a robot program: make newcomer.

The wheel is built first.  Then, with no cache and a Python environment that has pip alone, four commands
are run one after the other, each in a process of its own, and timed.
"""

from __future__ import annotations

import os
import platform
import resource
import subprocess
import sys
import tempfile
import time
import venv
from pathlib import Path

from docs.scripts.experiment import Page
from docs.scripts.page import DOCS, table

PAGE = Page("tutorial")
# Words of each command behind the program's name; the wheel's name follows those of pip.
_COMMANDS = (
    ("pip", "install"),
    ("elastic-robot", "init", "cell"),
    ("elastic-robot", "compensate", "cell/case.toml", "-o", "results/cell"),
    ("elastic-robot", "export", "results/cell", "--to", "krl"),
)


@PAGE.part
def newcomer() -> str:
    """Return the commands' times."""
    load = os.getloadavg()[0]
    with tempfile.TemporaryDirectory() as name:
        rows = _timed(Path(name).resolve())
    total = sum(wall for _, wall, _ in rows)
    lines = [(f"`{command}`", f"{wall:.0f}", f"{cpu:.0f}") for command, wall, cpu in rows]
    where = (
        f"{os.cpu_count()} cores, {_processor()}, Python {platform.python_version()}; load average"
        f" {load:.1f} before and {os.getloadavg()[0]:.1f} after, {total:.0f} s in all."
    )
    return f"{table(('command', 's', 's of CPU'), lines)}\n\n{where}"


def _timed(folder: Path) -> list[tuple[str, float, float]]:
    """Return each command, its seconds, and those of CPU that it and what it started took."""
    build = [sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", str(folder)]
    subprocess.run(build, cwd=DOCS.parent, check=True)
    (wheel,) = folder.glob("*.whl")
    home = folder / "environment"
    venv.create(home, with_pip=True)
    programs = home / ("Scripts" if os.name == "nt" else "bin")
    outside = {key: value for key, value in os.environ.items() if key != "PYTHONPATH"}
    outside |= {"XDG_CACHE_HOME": str(folder / "cache"), "PIP_NO_CACHE_DIR": "1"}
    found = []
    for program, *words in _COMMANDS:
        arguments = [*words, str(wheel)] if program == "pip" else words
        before, began = resource.getrusage(resource.RUSAGE_CHILDREN), time.monotonic()
        subprocess.run([str(programs / program), *arguments], cwd=folder, env=outside, check=True)
        wall, after = time.monotonic() - began, resource.getrusage(resource.RUSAGE_CHILDREN)
        cpu = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
        shown = " ".join([program, *words, *([wheel.name] if program == "pip" else [])])
        found.append((shown, wall, cpu))
        print(f"{shown}: {wall:.1f} s, {cpu:.1f} s of CPU", flush=True)
    (source,) = (folder / "results" / "cell" / "krl").glob("*.src")
    print(f"{source.name}: {len(source.read_text(encoding='ascii').splitlines())} lines")
    return found


def _processor() -> str:
    """Return the processor's name, as Linux tells it."""
    lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    return next(line.partition(": ")[2] for line in lines if line.startswith("model name"))


if __name__ == "__main__":
    PAGE.write()
