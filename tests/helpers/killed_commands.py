"""Commands that write several folders, stopped at random moments: `python killed_commands.py 100`.

identify, learn, next and place, each begun, killed or stopped by a signal, and given again until it
ends; beside its result there are files of a user.  What is left at the end is that of a command
which nobody has disturbed.
"""

from __future__ import annotations

import random
import signal
import sys
import tempfile
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from killing import Started, start
from line_case import changed_text
from places import CASES, LINE_CASE

from coupling.files.csv_table import read_table, write_table
from coupling.files.written_files import LIST

# What tells of the run itself: times, and the cost of the evaluations.
_OF_THE_RUN = ("run.json", "report.html", LIST)
_RETRIES = 6
# How a command is ended: half of all by what it cannot notice.
_SIGNALS = (signal.SIGKILL,) * 3 + (signal.SIGTERM, signal.SIGINT, signal.SIGHUP)


@dataclass(frozen=True)
class KilledCommand:
    """A command, and what it leaves that nobody disturbs.

    Attributes:
        words: Its words, "{out}" in them the place of its results.
        files: What it leaves there, by name.
        length: Time that it takes [s].
    """

    words: tuple[str, ...]
    files: dict[str, bytes]
    length: float

    @classmethod
    def of(cls, words: tuple[str, ...], folder: Path) -> KilledCommand:
        """Return the command, run undisturbed in a new folder."""
        folder.mkdir()
        begin = time.monotonic()
        _end(words, folder)
        return cls(words, _files(folder), time.monotonic() - begin)

    def round(self, folder: Path, chance: random.Random) -> int:
        """Kill the command a few times in a new folder, and let it end; return how often it was killed.

        Raises:
            AssertionError: If it is refused, loses a file of the user's or leaves something else.
        """
        folder.mkdir()
        theirs, kills = {}, 0
        for _ in range(chance.randint(1, _RETRIES)):
            run = start(folder.with_suffix(".txt"), *_filled(self.words, folder))
            if run.ends_within(chance.uniform(0.0, self.length)):
                assert run.status() in (0, 1), folder.with_suffix(".txt").read_text()
                break
            _stop(run, chance.choice(_SIGNALS))
            kills += 1
            for place in folder.iterdir():
                if place.is_dir() and (place / LIST).is_file() and not place.name.startswith("."):
                    (place / "measured.csv").write_text("mine")
                    theirs[f"{place.name.removesuffix('.unfinished')}/measured.csv"] = b"mine"
        else:
            _end(self.words, folder)
        found = _files(folder)
        assert {name: found.get(name) for name in theirs} == theirs
        assert {name: text for name, text in found.items() if name not in theirs} == self.files
        return kills


def _stop(run: Started, number: int) -> None:
    """Send a signal to a command, which then ends by it, or in order unless it was at its end."""
    if number == signal.SIGKILL:
        run.kill()
        return
    run.send(number)
    assert run.ends_within(60.0), f"does not end by signal {number}"
    status, text = run.status(), run.output.read_text()
    assert status in (-number, 130, 0, 1), f"{status} by signal {number}: {text}"
    assert "fault of this program" not in text, text


def _filled(words: tuple[str, ...], folder: Path) -> list[str]:
    return [word.format(out=folder) for word in words]


def _end(words: tuple[str, ...], folder: Path) -> None:
    """Run a command to its end."""
    output = folder.with_suffix(".txt")
    assert start(output, *_filled(words, folder)).status() in (0, 1), output.read_text()


def _files(folder: Path) -> dict[str, bytes]:
    """Return what a command has left, but for what tells of the run itself and pages' random names."""
    return {
        str(file.relative_to(folder)): file.read_bytes().replace(bytes(folder), b"{out}")
        for file in sorted(folder.rglob("*"))
        if file.is_file() and file.name not in _OF_THE_RUN and file.suffix not in (".html", ".lock")
    }


def _measured(run: Path, file: Path) -> Path:
    """Write what a measurement of a run's tool may say: its path, three per cent softer."""
    rows = [read_table(run / f"{name}.csv", ("time", "x", "y", "z"), ValueError) for name in
            ("command", "achieved")]  # fmt: skip
    time_, nominal = rows[1][:, 0], rows[0]
    steps = np.column_stack([np.interp(time_, nominal[:, 0], nominal[:, k]) for k in (1, 2, 3)])
    moved = rows[1][:, 1:] + 0.03 * (rows[1][:, 1:] - steps)
    write_table(file, ("time", "x", "y", "z"), np.column_stack([time_, moved]))
    return file


def _deflections(folder: Path) -> Path:
    """Write measured deflections: a plan, filled in with those of a soft spring."""
    file = folder / "plan.csv"
    assert start(folder / "plan.txt", "identify", "--plan", "-o", file).status() == 0
    head, names, *rows = file.read_text().splitlines()
    loads = [np.array(row.split(",")[-6:-3], float) for row in rows]
    cells = (",".join(f"{2e-6 * force:.6g}" for force in load) for load in loads)
    filled = [row.removesuffix(",,,") + f",{cell}" for row, cell in zip(rows, cells, strict=True)]
    file.write_text("\n".join((head, names, *filled)) + "\n")
    return file


def commands(folder: Path) -> Iterator[tuple[str, tuple[str, ...]]]:
    """Yield names and words of the commands, on small inputs that are written into a folder."""
    start(folder / "imports.txt", "robots").status()  # so that lengths are those of the work
    yield "identify", ("identify", str(_deflections(folder)), "-o", "{out}/robot.toml")
    place = "\n[place]\nx_m = [1.5, 1.7]\nz_m = [0.7, 0.9]\nsettings = 128\ncases = 1\n"
    (folder / "place.toml").write_text(LINE_CASE.read_text() + place)
    yield "place", ("place", str(folder / "place.toml"), "-o", "{out}/placed", "--no-store")
    text = changed_text(
        CASES / "cone.toml",
        ("radius_m       = 0.06", "radius_m       = 0.03"),
        ("depth_m        = 0.01", "depth_m        = 0.0005"),
    )
    (folder / "cone.toml").write_text(text)
    first = folder / "first"
    output = folder / "first.txt"
    status = start(output, "compensate", folder / "cone.toml", "-o", first, "--no-store").status()
    assert status == 0, output.read_text()
    runs = (str(first), str(_measured(first, folder / "measured.csv")))
    yield "next", ("next", *runs, "-o", "{out}/second", "--move", "path", "--no-store")
    yield "learn", ("learn", *runs, "-o", "{out}/robot.toml", "--no-store")


def main(rounds: int, seed: int = 1) -> None:
    """Kill every command in so many rounds, and say how it went."""
    chance = random.Random(seed)
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        for name, words in commands(folder):
            known = KilledCommand.of(words, folder / f"{name}_undisturbed")
            kills = 0
            for number in range(rounds):
                kills += known.round(folder / f"{name}_{number}", chance)
            print(f"{name}: {rounds} rounds, {kills} kills, {known.length:.1f} s each", flush=True)


if __name__ == "__main__":
    main(int(sys.argv[1]))
