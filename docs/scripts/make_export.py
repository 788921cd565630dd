"""Write the tables of docs/export.md from runs of three cases: make export."""

from __future__ import annotations

from functools import cache, partial
from pathlib import Path

from coupling.export.commands import commands_of_run
from coupling.export.exported_program import ExportedProgram, ExportOptions
from coupling.export.exporting import export_commands
from coupling.programs.languages import LANGUAGES
from coupling.run.folder import write_run
from docs.scripts.experiment import Page, results, scratch
from docs.scripts.runs import compensated, example

CASES = ("cone", "milling_20000", "iso9283")
PAGE = Page("export")
# The last of them ten times as fast.
_FAST = "iso9283_fast"
# What the tables above have as least time between targets [s].
_CLOSEST = 0.004
# Of sensor interfaces [s].
CYCLES = (0.004, 0.012)


@cache
def _run(name: str) -> Path:
    """Return the run folder of a case."""
    keys: dict[str, float | str] = {"feed_m_s": 1.0} if name == _FAST else {}
    changes = {"tool_path": keys} if keys else {}
    case, folder = example(name.removesuffix("_fast"), **changes), scratch(name)
    folder.mkdir()
    write_run(folder, case, compensated(case))
    return folder


@cache
def _exported(name: str, language: str) -> ExportedProgram:
    own = LANGUAGES[language]
    closest = None if own.dense else _CLOSEST
    (found,) = export_commands(
        commands_of_run(_run(name)), ExportOptions(own, own.targets[0], shortest=closest)
    )
    return found


@PAGE.part
def programs() -> str:
    """Return points, bytes and loss of every case in every language."""

    def loss(found: ExportedProgram) -> tuple[str, ...]:
        figures = found.figures
        command, file = figures.deviation_of_command_m, figures.deviation_of_file_m
        assert command is not None
        assert file is not None
        return tuple(map(_um, (command.maximum, file.maximum, figures.loss_m)))

    return results(
        ("case", "language"),
        {(f"`{name}`", language): (name, language) for name in CASES for language in LANGUAGES},
        lambda case: _exported(*case),
        {
            "points": lambda found: (
                f"{found.figures.points} of {found.figures.points_on_every_cycle}"
            ),
            "kB": lambda found: f"{1e-3 * sum(file.bytes for file in found.figures.files):.0f}",
            "command [um]": lambda found: loss(found)[0],
            "file [um]": lambda found: loss(found)[1],
            "loss [um]": lambda found: loss(found)[2],
        },
    )


@PAGE.part
def cycles() -> str:
    """Return what rows of angles lose on a cycle, as they are written."""

    def loss(name: str, cycle: float) -> str:
        options = ExportOptions(LANGUAGES["csv"], "joints", cycle=cycle)
        (exported,) = export_commands(commands_of_run(_run(name)), options)
        return _um(exported.figures.loss_m)

    cases = {f"`{name}`": name for name in CASES} | {"`iso9283` at 1 m/s": _FAST}
    heads = {cycle: f"loss on {1e3 * cycle:.0f} ms [um]" for cycle in CYCLES}
    columns = {head: partial(loss, cycle=cycle) for cycle, head in heads.items()}
    return results(("case",), cases, str, columns)


def _um(length: float) -> str:
    return f"{1e6 * length:.2f}"


if __name__ == "__main__":
    PAGE.write()
