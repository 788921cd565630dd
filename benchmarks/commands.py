"""CPU seconds of the commands by part, of this checkout and of an earlier commit in the same run.

    python -m benchmarks.commands                      against the commit before, about ten minutes
    python -m benchmarks.commands --against v0.1.0 --only check study
    python -m benchmarks.commands --page               and write the table of docs/performance.md

Each command runs in a process of its own, of one checkout and of the other in turn, on the same files.
Seconds are those of all processors and processes; compare ratios, not seconds.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np

from coupling.files.csv_table import read_table, write_table
from docs.scripts.page import replace, table

ROOT = Path(__file__).parents[1]
CASES = ROOT / "examples" / "cases"
# One contour of the cone, 23 s, which can be learned from.
_SHORT = {
    "radius_m       = 0.06": "radius_m       = 0.03",
    "depth_m        = 0.01": "depth_m        = 0.0005",
}
# A contour of 8 mm on a sheet of 50 mm.
_SMALL_SHEET = {
    "radius_m       = 0.06": "radius_m = 0.008",
    "depth_m        = 0.005": "depth_m = 0.001",
    "[0.16, 0.16]": "[0.05, 0.05]",
    "[process]\n": "[process]\nelement_m = 0.005\n",
}
_RUN, _MEASURED = "{folder}/run", "{folder}/m.csv"
COMMANDS = {
    "start": ("robots",),
    "compensate cone": ("compensate", CASES / "cone.toml", "--no-store"),
    "compensate cone_fem": ("compensate", CASES / "cone_fem.toml", "--no-store"),
    "check cone": ("check", CASES / "cone.toml"),
    "place cone": ("place", CASES / "cone.toml", "--no-store"),
    "next": ("next", _RUN, _MEASURED, "--no-store"),
    "learn": ("learn", _RUN, _MEASURED, "--no-store"),
    "export": ("export", _RUN, "--to", "krl"),
    "study": ("study", CASES / "cone.toml", "--samples", "64", "--workers", "1"),
}
# What is compiled and kept, the C core, the sheet's loops and bytecode, is not of the commands.
_BEFOREHAND = ("check cone", "small sheet")
_LEAST = 0.05  # Parts that take less are left out [s].


def parts_of(checkout: Path, command: str, folder: Path) -> dict[str, float]:
    """Return the CPU seconds of a command of a checkout by part.

    Args:
        command: Its name in `COMMANDS`, or "small sheet".
        folder: The folder of `write_inputs`.

    Raises:
        RuntimeError: If it prints no times; with what it says.
    """
    own = COMMANDS.get(command, ("couple", "{folder}/sheet.toml", "--no-store"))
    filled = [str(word).format(folder=folder) for word in own]
    with tempfile.TemporaryDirectory() as place:
        name = "page.html" if command.startswith("check") else "out"
        words = [*filled, *(() if command == "start" else ("-o", str(Path(place, name))))]
        script = [sys.executable, str(ROOT / "benchmarks" / "command_parts.py"), str(checkout)]
        # Processes that a command starts are of its checkout as well.
        folders = os.pathsep.join(str(Path(checkout, part)) for part in (".", "fmu_src"))
        environment = {**os.environ, "PYTHONPATH": folders, "PYTHONPYCACHEPREFIX": str(folder)}
        environment.pop("PYTHONDONTWRITEBYTECODE", None)
        done = subprocess.run(
            [*script, *words], cwd=place, env=environment, capture_output=True, text=True
        )
    lines = done.stdout.splitlines()
    if done.returncode != 0 or not lines:
        raise RuntimeError(f"{checkout}: {' '.join(words)}: {done.stderr}")
    times: dict[str, float] = json.loads(lines[-1])
    return times


def write_inputs(folder: Path) -> None:
    """Write a run, a measurement of its tool, which gave way three per cent more, and a small sheet."""
    _write_changed(CASES / "cone_fem.toml", _SMALL_SHEET, folder / "sheet.toml")
    _write_changed(CASES / "cone.toml", _SHORT, folder / "case.toml")
    command = [sys.executable, "-m", "coupling.cli", "compensate", str(folder / "case.toml")]
    subprocess.run(
        [*command, "-o", str(folder / "run"), "--no-store"],
        cwd=ROOT,
        check=True,
        capture_output=True,
    )
    columns = ("time", "x", "y", "z")
    command_rows, achieved = (
        read_table(folder / "run" / f"{name}.csv", columns, ValueError)
        for name in ("command", "achieved")
    )
    time = achieved[:, 0]
    undeflected = [np.interp(time, command_rows[:, 0], column) for column in command_rows[:, 1:].T]
    moved = achieved[:, 1:] + 0.03 * (achieved[:, 1:] - np.stack(undeflected, axis=1))
    moved += 1e-5 * np.random.default_rng(1).standard_normal(moved.shape)
    write_table(folder / "m.csv", columns, np.column_stack([time, moved]))


def _write_changed(case: Path, changes: dict[str, str], file: Path) -> None:
    text = case.read_text(encoding="utf-8")
    for old, new in changes.items():
        assert old in text, old
        text = text.replace(old, new)
    file.write_text(text, encoding="utf-8")


@contextmanager
def checkout_of(commit: str) -> Iterator[Path]:
    """Give a checkout of a commit, or the folder that is named."""
    if Path(commit).is_dir():
        yield Path(commit).resolve()
        return
    with tempfile.TemporaryDirectory() as place:
        folder, git = Path(place, "before"), ("git", "-C", str(ROOT), "worktree")
        subprocess.run([*git, "add", "--quiet", "--detach", str(folder), commit], check=True)
        try:
            yield folder
        finally:
            subprocess.run([*git, "remove", "--force", str(folder)], check=True)


def rows_of(command: str, before: dict[str, float], now: dict[str, float]) -> list[tuple[str, ...]]:
    """Return the lines of the table of a command: its sum, then its parts."""
    sums = [("all", sum(before.values()), sum(now.values()))]
    parts = [(name, before.get(name, 0.0), now.get(name, 0.0)) for name in {**before, **now}]
    parts = [part for part in parts if max(part[1:]) >= _LEAST]
    lines = sums + sorted(parts, key=lambda part: -max(part[1:]))
    return [
        (
            command if name == "all" else "",
            name,
            f"{old:.2f}",
            f"{new:.2f}",
            f"{new / old:.2f}" if old else "",
        )
        for name, old, new in lines
    ]


def main() -> None:
    """Time the commands and print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--against", default="HEAD~1", help="a commit, or a folder with a checkout")
    parser.add_argument("--only", nargs="+", default=list(COMMANDS), choices=COMMANDS)
    parser.add_argument("--page", action="store_true")
    options = parser.parse_args()
    for library in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
        os.environ[library] = "1"
    rows = []
    with tempfile.TemporaryDirectory() as place, checkout_of(options.against) as earlier:
        write_inputs(Path(place))
        for checkout in (earlier, ROOT):
            for command in _BEFOREHAND:
                parts_of(checkout, command, Path(place))
        for command in options.only:
            before, now = (parts_of(own, command, Path(place)) for own in (earlier, ROOT))
            lines = rows_of(command, before, now)
            for line in lines:
                print("  ".join(f"{cell:>20}" for cell in line), flush=True)
            rows += lines
    if options.page:
        head = ("command", "before [s]", "now [s]", "now / before")
        sums = [(command, *figures) for command, part, *figures in rows if part == "all"]
        replace("performance", "commands", table(head, sums))


if __name__ == "__main__":
    main()
