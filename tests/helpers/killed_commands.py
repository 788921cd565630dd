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
from collections import Counter
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from killing import Started, start
from line_case import changed_text, moving_line
from places import LINE_CASE

from coupling.files.csv_table import read_table, write_table
from coupling.files.written_files import LIST

# What tells of the run itself: times, and the cost of the evaluations.
_OF_THE_RUN = ("run.json", "report.html", LIST)
_RETRIES = 3
_HAS_RESULT = "holds a result already: add --overwrite to replace it\n"
# The shortest run that can be learned from, 2 s, of few samples and gears without backlash.
_STROKE = moving_line(
    ('"backlash"', '"linear"'),
    (
        "[[0.0, 0.0, 0.002], [0.0, 0.0, -0.002], [0.06, 0.0, -0.002], [0.06, 0.0, 0.002]]",
        "[[0.0, 0.0, 0.0], [0.02, 0.0, -0.002]]",
    ),
    ("feed_m_s = 0.1", "feed_m_s = 0.011"),
    ("blend_s  = 0.1", "blend_s  = 0.2"),
    ("sample_s = 0.01", "sample_s = 0.02"),
    ("[compensation]", '[controller]\ncycle_s = 0.02\ninterpolation = "quintic"\n\n[compensation]'),
)
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
                _require_end(run)
                break
            _stop(run, chance.choice(_SIGNALS))
            kills += 1
            for place in folder.iterdir():
                if place.is_dir() and (place / LIST).is_file() and not place.name.startswith("."):
                    (place / "measured.csv").write_text("mine")
                    theirs[f"{place.name.removesuffix('.unfinished')}/measured.csv"] = b"mine"
        else:
            _end(self.words, folder)
        remaining, expected = _files(folder), self.files | theirs
        differing = {
            name: (remaining.get(name), expected.get(name))
            for name in remaining.keys() | expected.keys()
            if remaining.get(name) != expected.get(name)
        }
        assert not differing, f"after {kills} kills, expected the second of each: {differing}"
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
    _require_end(start(folder.with_suffix(".txt"), *_filled(words, folder)))


def _require_end(run: Started) -> None:
    """Wait for the end of a command, which has a result, or had one when its last attempt was killed."""
    status, text = run.status(), run.output.read_text()
    assert status in (0, 1) or (status == 2 and text.endswith(_HAS_RESULT)), f"{status}: {text}"


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


def deflections(folder: Path) -> Path:
    """Write measured deflections: a plan, filled in with those of a soft spring."""
    file = folder / "plan.csv"
    assert start(folder / "plan.txt", "identify", "--plan", "-o", file).status() == 0
    head, names, *rows = file.read_text().splitlines()
    loads = [np.array(row.split(",")[-6:-3], float) for row in rows]
    cells = (",".join(f"{2e-6 * force:.6g}" for force in load) for load in loads)
    filled = [row.removesuffix(",,,") + f",{cell}" for row, cell in zip(rows, cells, strict=True)]
    file.write_text("\n".join((head, names, *filled)) + "\n")
    return file


def placing(folder: Path) -> Path:
    """Write a case of few settings for the command place; return its file."""
    place = (
        "\n[place]\nx_m = [1.5, 1.7]\nz_m = [0.7, 0.9]\nyaw_deg = [0.0, 0.0]\n"
        'rotation_deg = [0.0, 0.0]\nsettings = 100\ncases = 1\noptimise = "stiffness"\n'
    )
    file = folder / "place.toml"
    file.write_text(changed_text(LINE_CASE, ("0.01", "0.02")) + place)
    return file


def commands(folder: Path) -> dict[str, tuple[str, ...]]:
    """Return words of the commands by their names, on small inputs that are written into a folder."""
    start(folder / "imports.txt", "robots").status()  # so that lengths are those of the work
    (folder / "stroke.toml").write_text(_STROKE)
    output = folder / "first.txt"
    first = start(
        output, "compensate", folder / "stroke.toml", "-o", folder / "first", "--no-store"
    )
    assert first.status() == 0, output.read_text()
    runs = (str(folder / "first"), str(_measured(folder / "first", folder / "measured.csv")))
    path = ("--move", "path", "--cutoff-Hz", "1")
    return {
        "identify": (
            "identify", str(deflections(folder)), "-o", "{out}/robot.toml", "--torque-curve", "linear",
        ),
        "place": ("place", str(placing(folder)), "-o", "{out}/placed", "--no-store"),
        "next": ("next", *runs, "-o", "{out}/second", *path, "--no-store"),
        "learn": ("learn", *runs, "-o", "{out}/learned", "--no-store"),
    }  # fmt: skip


def main(rounds: int, seed: int = 1) -> None:
    """Kill every command in so many rounds in turn, and say how it went."""
    chance = random.Random(seed)
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        known = {
            name: KilledCommand.of(words, folder / f"{name}_undisturbed")
            for name, words in commands(folder).items()
        }
        kills: Counter[str] = Counter()
        for number in range(1, rounds + 1):
            for name, command in known.items():
                kills[name] += command.round(folder / f"{name}_{number}", chance)
                print(
                    f"{name}: {number} rounds, {kills[name]} kills, {command.length:.1f} s each",
                    flush=True,
                )


if __name__ == "__main__":
    main(int(sys.argv[1]))
