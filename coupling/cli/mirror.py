"""elastic-robot mirror: a measured deviation subtracted from the command that led to it."""

from __future__ import annotations

import io
from pathlib import Path
from typing import Annotated

import numpy as np
import typer
from rich.console import Console

from coupling.errors import LearnError
from coupling.files.csv_table import POSE_COLUMNS, read_header, read_table, write_table
from coupling.files.whole_file import make_folder_of, write_whole
from coupling.inverse.joint_limits import JointLimits
from coupling.learn.alignment import aligned
from coupling.learn.measured import read_seen
from coupling.learn.mirrored import CUT_OFF, measured_deviation, mirrored
from coupling.learn.source import read_source
from coupling.path.deviation import less_constant, root_mean_square
from coupling.path.histories import JointPath
from coupling.robot.inverse_kinematics import InverseKinematics
from coupling.run.drive_motion import drive_motions
from coupling.run.stored_run import drive_columns


def mirror(
    run: Annotated[Path, typer.Argument(help="Run folder of the path.")],
    measured: Annotated[Path, typer.Argument(help="Where the tool was: time, x, y, z; CSV.")],
    output: Annotated[Path, typer.Option("-o", "--output", help="The next command, a CSV file.")],
    command: Annotated[
        Path | None,
        typer.Option(help="What was commanded, if not the run's: the last mirrored command."),
    ] = None,
    cut_off_hz: Annotated[
        float,
        typer.Option("--cut-off-Hz", min=0.05, max=5.0, help="What is faster is not subtracted."),
    ] = CUT_OFF,
    own_frame: Annotated[
        bool, typer.Option("--own-frame", help="The measuring frame lies anywhere.")
    ] = False,
) -> None:
    """Subtract the slow part of a measured deviation from a command; needs no parameters."""
    if output.suffix != ".csv":
        raise LearnError(f"--output: expected a name that ends in .csv, got {output.name!r}")
    source = read_source(run, read_seen(measured))
    joints = (
        source.stored.joints if command is None else _read_command(command, source.stored.joints)
    )
    seen = aligned(source.seen, source.stored.desired, own_frame)
    deviation, clock = measured_deviation(seen, source.stored.desired)
    found = mirrored(source.robot, joints, seen.time + clock, deviation, cut_off_hz)
    planner = InverseKinematics(source.robot, source.home)
    poses = planner.forward(found, found.time).pose[0]
    table = io.StringIO()
    rows = np.column_stack([found.time, poses, *found.columns.values()])
    write_table(table, ("time", *POSE_COLUMNS, *found.columns), rows)
    make_folder_of(output, LearnError)
    write_whole(output, table.getvalue(), LearnError)
    rest = np.linalg.norm(less_constant(seen.time, deviation), axis=1)
    size = 1e6 * root_mean_square(seen.time, rest)
    console = Console()
    lines = [
        f"{measured}: {size:.1f} um rms less a constant, of which what is slower than {cut_off_hz:g} Hz"
        f" is subtracted, from {seen.time[0]:.2f} to {seen.time[-1]:.2f} s.",
        *_beyond(found, JointLimits.of(source.robot)),
        f"Next command: {output}",
    ]
    console.print("\n".join(lines), highlight=False, markup=False, soft_wrap=True)


def _read_command(file: Path, like: JointPath) -> JointPath:
    """Return a command of the same kind as another one."""
    names = drive_columns(read_header(file, LearnError))
    width = like.q[0].shape[1]
    if [len(block) for block in names[:1]] != [width]:
        raise LearnError(f"{file}: expected columns q1 to q{width}, got {len(names[0])} angles")
    wanted = [block for block in names if block]
    table = read_table(file, ("time", *sum(wanted, ())), LearnError)
    blocks = np.split(table[:, 1:], np.cumsum([len(block) for block in wanted])[:-1], axis=1)
    try:
        return JointPath(table[:, 0], *((block,) for block in blocks))
    except ValueError as cause:
        raise LearnError(f"{file}: {cause}") from cause


def _beyond(command: JointPath, limits: JointLimits) -> list[str]:
    """Return a line for each drive that is asked for more than it can."""
    lines = []
    for drive in drive_motions(command, limits):
        for what, value, limit in (
            ("rad/s", drive.rate, drive.rate_limit),
            ("rad/s^2", drive.acceleration, drive.acceleration_limit),
        ):
            if limit is not None and value > limit:
                lines.append(
                    f"Warning: joint {drive.joint} is asked for {value:.3g} {what}, its limit is"
                    f" {limit:.3g}"
                )
    return lines
