"""The process sheet-fem: frames, repeatability, windows, files, messages."""

import tomllib
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from calculix_disc import Disc, disc_force
from calculix_plate import CCX, Plate, plunge_force
from fixture_store import stored
from killing import start
from line_case import changed_text
from places import CASES
from scipy.spatial.transform import Rotation

pytest.importorskip("numba")

from coupling.errors import CaseError
from coupling.events import Progress
from coupling.path.frame import Frame
from coupling.path.histories import ToolPath
from coupling.path.linear import interpolate_rows
from coupling.path.workpiece import Workpiece
from coupling.process import PROCESSES, ProcessResponse
from coupling.process.sheet_fem import PLASTIC_STRAIN, SPRINGBACK, THICKNESS, SheetFem
from coupling.run.stored_run import read_run
from coupling.sheet_fem.schedule import schedule
from coupling.toolpaths import Task
from coupling.toolpaths.part import tool_path


def table(**changes):
    data = tomllib.loads((CASES / "cone_fem.toml").read_text())["process"]
    data |= {"sheet_size_m": [0.04, 0.04], "element_m": 0.005, "position_m": 0.002}
    return PROCESSES["sheet-fem"].model_validate(data | changes)


def stroke(part: Frame) -> ToolPath:
    """Return a plunge of 0.4 mm, 4 mm along x, and up again, in the part's frame."""
    corners = np.array(
        [[-2e-3, 1e-3, 1e-3], [-2e-3, 1e-3, -4e-4], [2e-3, 1e-3, -4e-4], [2e-3, 1e-3, 1e-3]]
    )
    at = np.linspace(0.0, 3.0, 31)
    points = interpolate_rows(at, np.arange(4.0), corners)
    return tool_path(part, at, points)


def evaluated(process: SheetFem, path: ToolPath) -> ProcessResponse:
    return stored(_evaluate, process.identity, path, using=(process,))


def _evaluate(identity: str, path: ToolPath, process: SheetFem) -> ProcessResponse:
    return process.evaluate(path)


UPRIGHT = Frame(np.zeros(3), Rotation.identity())


@pytest.fixture(scope="module")
def pressed():
    """A process, a path and its response, computed here: another process may give other last bits."""
    path = stroke(UPRIGHT)
    process = table().process(Task(UPRIGHT, path))
    return process, path, process.evaluate(path)


def test_force_pushes_the_tool_off_the_sheet_and_only_in_contact(pressed):
    _, path, answer = pressed
    fz = answer.wrench.wrench[0, :, 2]
    height = path.position[0, :, 2]
    assert np.all(fz[(height < -3e-4)] > 10.0)
    assert np.all(answer.wrench.wrench[0, [0, -1]] == 0.0)


def test_an_evaluation_starts_from_the_flat_sheet(pressed):
    """Twice the same, to the last bit: nothing is kept between evaluations."""
    process, path, answer = pressed
    again = process.evaluate(path)
    assert np.array_equal(answer.wrench.wrench, again.wrench.wrench)


def blas_threads() -> list[int]:
    from threadpoolctl import threadpool_info

    return [
        library["num_threads"] for library in threadpool_info() if library["user_api"] == "blas"
    ]


def test_an_evaluation_keeps_blas_to_one_thread_and_gives_the_others_back(pressed):
    """In a user's own program, where nothing else has: it takes a third of the time then."""
    from threadpoolctl import threadpool_limits

    process, path, answer = pressed
    within = []

    def watch(progress: Progress) -> None:
        within.append(blas_threads())

    with threadpool_limits(limits=2, user_api="blas"):
        given = blas_threads()
        again = replace(process, watch=watch).evaluate(path)
        assert blas_threads() == given
    assert 2 in given
    assert within
    assert {count for counts in within for count in counts} == {1}
    assert np.array_equal(answer.wrench.wrench, again.wrench.wrench)


def arcs(turns: float, *depths: float) -> tuple[np.ndarray, np.ndarray]:
    """Return times and points of arcs of 12 mm radius, each where the last ends, after one above."""
    turn = np.linspace(0.0, 2.0 * np.pi * turns, round(30 * turns) + 1)
    below = [
        np.column_stack([0.012 * np.cos(at), 0.012 * np.sin(at), np.full(len(at), -depth)])
        for at, depth in ((turn + k * turn[-1], depth) for k, depth in enumerate(depths))
    ]
    points = np.vstack([[[0.012, 0.0, 1e-3]], *below])
    return np.arange(len(points), dtype=float), points


def test_the_stated_force_is_within_5_percent_of_the_limit_of_small_elements():
    """The limit is Richardson's, of what elements of 0.4 and 0.28 radii compute: order two."""
    at, points = arcs(0.5, 1.5e-3)
    path = tool_path(UPRIGHT, at, points)
    stated, computed = [], []
    for element in (0.002, 0.0014):
        process = table(sheet_size_m=[0.056, 0.056], element_m=element, position_m=None).process(
            Task(UPRIGHT, path)
        )
        stated.append(np.mean(evaluated(process, path).wrench.force[0, 5:-3, 2]))
        computed.append(stated[-1] / process.force_factor)
    finer = (0.002 / 0.0014) ** 2
    limit = computed[1] + (computed[1] - computed[0]) / (finer - 1.0)
    assert computed[0] > 1.05 * limit
    assert stated[0] == pytest.approx(limit, rel=0.05)


def test_a_path_off_by_half_a_micron_has_nearly_the_same_forces():
    """Or no command could be computed: forces answer in proportion, they do not jump."""
    at, points = arcs(1.0, 1.5e-3, 3e-3)
    process = table(sheet_size_m=[0.056, 0.056], element_m=None, position_m=None).process(
        Task(UPRIGHT, tool_path(UPRIGHT, at, points))
    )
    off = 5e-7 * np.sin(np.outer(at, [0.7, 1.1, 1.7]))
    there, near, far = (
        evaluated(process, tool_path(UPRIGHT, at, points + moved)).wrench.force[0]
        for moved in (0.0 * off, off, 2.0 * off)
    )
    apart = np.linalg.norm(far - there, axis=1).max()
    assert apart < 3.0  # [N]; the sheet holds the tool with less than 2 N/um
    assert np.linalg.norm(far - 2.0 * near + there, axis=1).max() < 0.1 * apart


def test_a_moved_and_turned_part_turns_the_wrench(pressed):
    """Force and moment at the TCP are those of the same part elsewhere, in its axes."""
    part = Frame(np.array([1.6, -0.3, 0.8]), Rotation.from_rotvec([0.3, -0.5, 0.9]))
    path = stroke(part)
    elsewhere = evaluated(table().process(Task(part, path)), path).wrench
    back = elsewhere.transformed(part.inverse()).wrench[0]
    here = pressed[2].wrench.wrench[0]
    scale = np.max(np.abs(here[:, :3]))
    for columns, size in ((slice(0, 3), scale), (slice(3, 6), 5e-3 * scale)):
        np.testing.assert_allclose(back[:, columns], here[:, columns], atol=1e-5 * size)


def test_frictionless_force_has_no_moment_about_the_sphere(pressed):
    """The TCP is the sphere's lowest point: M = (centre - TCP) x F."""
    wrench = pressed[2].wrench.wrench[0]
    lever = np.array([0.0, 0.0, 5e-3])
    np.testing.assert_allclose(wrench[:, 3:], np.cross(lever, wrench[:, :3]), atol=1e-12)


def test_touch_is_where_the_lowest_point_meets_the_upper_face():
    """A tool 10 um above the part's plane feels nothing, 30 um below it feels the sheet."""
    for height, touches in ((1e-5, False), (-3e-5, True)):
        path = tool_path(
            UPRIGHT, np.arange(3.0), np.array([[0, 0, 1e-3], [0, 0, height], [0, 0, 1e-3]])
        )
        wrench = table(element_m=0.002).process(Task(UPRIGHT, path)).evaluate(path).wrench.wrench[0]
        assert (wrench[1, 2] > 0.1) == touches


def test_the_tool_springs_back_less_than_it_pressed(pressed):
    piece = pressed[2].workpiece
    deepest = piece.points[:, 2].min() + 0.5e-3
    assert -4e-4 < deepest < -1e-5, "a dent is left, shallower than the plunge"
    assert piece.point_fields[SPRINGBACK].max() > 1e-5
    assert piece.cell_fields[PLASTIC_STRAIN].max() > 1e-3
    assert np.all(piece.cell_fields[THICKNESS] < 1.001e-3)


def test_window_agrees_with_the_whole_sheet():
    """Elements four times as large away from the tool change the force by less than three hundredths."""
    path = stroke(UPRIGHT)
    task = Task(UPRIGHT, path)
    size = {"sheet_size_m": [0.1, 0.1], "element_m": 0.0025}
    whole = evaluated(table(**size, window_m=0.1).process(task), path).wrench
    window = evaluated(table(**size).process(task), path).wrench
    assert np.max(np.abs(whole.wrench - window.wrench)) > 0.0
    assert window.change_from(whole) < 0.03


def test_progress_counts_up_to_the_end(pressed):
    process, path, _ = pressed
    seen: list[Progress] = []
    replace(process, watch=seen.append).evaluate(path)
    assert seen[0].done == 0
    assert seen[-1].done == seen[-1].total == len(process.schedule.positions)
    assert [work.done for work in seen] == sorted(work.done for work in seen)


def test_schedule_has_corners_and_spacing_closer_in_depth():
    points = np.array(
        [[0, 0, 0], [0, 0, -1], [1, 0, -1], [2, 0, -1], [3, 0, -1], [3, 2.6, -1], [3, 2.6, 0.0]]
    )
    plan = schedule(1e-3 * points, 2e-3)
    assert plan.positions.tolist() == [0, 1, 3, 4, 5, 6]
    assert plan.arc[-1] == pytest.approx(7.6e-3)


def test_bad_tables_say_what_is_needed():
    with pytest.raises(ValueError, match="at most a fifth of the sheet's side"):
        table(element_m=0.02)
    with pytest.raises(ValueError, match="expected backing_radius_m beside it"):
        table(backing_edge_radius_m=0.002)
    path = stroke(UPRIGHT)
    with pytest.raises(CaseError, match="which the tool path spans"):
        table(sheet_size_m=[0.003, 0.04], element_m=0.0005).process(Task(UPRIGHT, path))


@pytest.mark.parametrize("package", ["numba", "threadpoolctl"])
def test_without_its_packages_the_extra_is_named(tmp_path, package):
    arguments = "couple", "-v", CASES / "cone_fem.toml", "-o", tmp_path / "out"
    run = start(tmp_path / "output.txt", *arguments, missing=[package])
    assert run.status() == 2
    said = " ".join((tmp_path / "output.txt").read_text().split())
    assert f"needs the package {package}, which is not installed" in said
    assert "elastic-robot-fmu[fem]" in said
    assert "Traceback" not in said


def test_a_workpiece_survives_its_file(tmp_path, pressed):
    piece = pressed[2].workpiece
    piece.write(tmp_path / "piece.vtu")
    back = Workpiece.read(tmp_path / "piece.vtu")
    assert np.array_equal(back.points, piece.points)
    assert np.array_equal(back.cells, piece.cells)
    for name, values in piece.point_fields.items():
        assert np.array_equal(back.point_fields[name], values)
    for name, values in piece.cell_fields.items():
        assert np.array_equal(back.cell_fields[name], values)


def test_couple_leaves_the_formed_sheet_in_the_run_folder_and_the_report(command, tmp_path):
    """The example cut down to one contour of 8 mm radius on a sheet of 50 mm."""
    text = changed_text(
        CASES / "cone_fem.toml",
        ("radius_m       = 0.06", "radius_m = 0.008"),
        ("depth_m        = 0.005", "depth_m = 0.001"),
        ("[0.16, 0.16]", "[0.05, 0.05]"),
        ("[process]\n", "[process]\nelement_m = 0.005\n"),
    )
    text += "\n[coupling]\ntolerance_m = 1e-4\nmax_evaluations = 2\n"
    (tmp_path / "small.toml").write_text(text)
    done = command("couple", "-v", tmp_path / "small.toml", "-o", tmp_path / "out")
    assert done.returncode in (0, 1), done.stderr
    run = read_run(tmp_path / "out")
    assert set(run.workpieces) == {"actual"}
    assert run.workpieces["actual"].points[:, 2].min() < -1e-3
    page = (tmp_path / "out" / "report.html").read_text()
    assert "Section of the workpiece" in page
    assert 'id="cut"' in page


@pytest.mark.skipif(CCX is None, reason="needs the Debian package calculix-ccx")
def test_plunge_of_a_thick_sheet_agrees_with_calculix(tmp_path):
    """A disc of 1.63 mm under a sphere of 12.66 mm, 1.4 to 2.4 mm deep: shell and solids within 6 %."""
    from coupling.sheet_fem.forming import SheetModel
    from coupling.sheet_fem.material import Material
    from coupling.sheet_fem.mesh import SheetMesh

    strains = np.concatenate([[0.0], np.geomspace(1e-4, 3.0, 80)])
    curve = [(float(e), 343.3 * (0.0015 + float(e)) ** 0.184) for e in strains]
    disc = Disc(edge=14.0, plunge=2.4, elements=24, layers=2, increments=12)
    depths, forces = disc_force(disc, curve, 72e3, 0.33, tmp_path)
    metal = Material(72e9, 0.33, 343.3e6, 0.0015, 0.184)
    mesh = SheetMesh((0.032, 0.032), (20, 20), 1.63e-3)
    held = np.linalg.norm(mesh.control_points()[..., :2], axis=-1)
    held = held >= 0.014 - 0.5 * 1.6e-3  # as a clamped edge holds its control points
    model = SheetModel(mesh, metal, free=np.repeat(~held[..., None], 3, axis=2))
    heights = 1e-3 * (6.33 + 0.815 - np.arange(0.0, 2.41, 0.12))
    tools = [model.sphere(np.array([0.0, 0.0, height]), 6.33e-3) for height in heights]
    state = model.flat()
    for before, after in pairwise(tools):
        found = model.equilibrium(state, (before,), (after,), model.everywhere())
        state = found.state
        depth = 1e3 * (heights[0] - after.center[2])
        if depth > 1.4:
            solid = np.interp(depth, depths, forces)
            assert found.forces[0, 2] == pytest.approx(solid, rel=0.06)


@pytest.mark.skipif(CCX is None, reason="needs the Debian package calculix-ccx")
def test_plunge_agrees_with_calculix(tmp_path):
    """Clamped plate of 30 mm, sphere of 10 mm, 0.2 mm deep: shell and solids within 6 %."""
    from coupling.sheet_fem.forming import SheetModel
    from coupling.sheet_fem.material import Material
    from coupling.sheet_fem.mesh import SheetMesh

    metal = Material(70e9, 0.33, 180e6, 0.00057, 0.229)
    strains = np.concatenate([[0.0], np.logspace(-4, 0, 30)])
    curve = [(float(e), 180.0 * (0.00057 + float(e)) ** 0.229) for e in strains]
    plate = Plate(side=30.0, elements=8, layers=2, finest=1.0, plunge=0.2, increment=0.5)
    depths, forces = plunge_force(plate, curve, 70e3, 0.33, tmp_path)
    model = SheetModel(SheetMesh((0.03, 0.03), (20, 20), 1e-3), metal)
    state, tool = model.flat(), model.sphere(np.array([0.0, 0.0, 5.5e-3]), 5e-3)
    for depth in (0.05, 0.1, 0.15, 0.2):
        lower = model.sphere(np.array([0.0, 0.0, 5.5e-3 - 1e-3 * depth]), 5e-3)
        found = model.equilibrium(state, (tool,), (lower,), model.everywhere())
        state, tool = found.state, lower
        if depth >= 0.1:
            assert found.forces[0, 2] == pytest.approx(np.interp(depth, depths, forces), rel=0.06)
