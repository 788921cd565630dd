"""The search against brute force on fine grids, and what an objective asks for."""

import numpy as np
import pytest

from coupling.case.place import PlaceTable
from coupling.errors import PlanningError
from coupling.events import Progress
from coupling.place.coarse_screen import CoarseScreen
from coupling.place.objective import OBJECTIVES, PlaceDemands, PlaceObjective
from coupling.place.place import place
from coupling.place.placing import placing
from coupling.place.screen import ScreenFigures
from coupling.place.search import FoundSettings, fill_box, refine_settings
from coupling.place.search_state import STATE, SearchState
from coupling.place.settings import NAMES, Ranges
from docs.scripts.runs import example

# A line across a wall of the example robot: seconds, not minutes, and a force.
LINE = {
    "tool_path": {"depth_m": 0.001, "radius_m": 0.04},
    "controller": {"cycle_s": 0.004},
}
ANGLES = ("yaw", "lead", "lean", "rotation", "base_roll")


def untold(done: int, total: int) -> None:
    pass


def boxed(place: dict, objective: str):
    """The example cone, shorter, free in some settings only."""
    free = {f"{name}_m": [value, value] for name, value in zip("xyz", (1.6, 0.0, 0.8), strict=True)}
    free |= {f"{name}_deg": [0.0, 0.0] for name in ANGLES}
    case = example("cone", **LINE, place={**free, "settings": 1024, **place})
    return placing(case, case.process, objective)


@pytest.mark.parametrize(
    ("objective", "free", "counts"),
    [
        ("stiffness", {"x_m": [0.9, 1.9], "z_m": [0.4, 1.2]}, (41, 33)),
        ("backlash", {"lean_deg": [-30.0, 30.0], "base_roll_deg": [-8.0, 8.0]}, (61, 41)),
        ("both", {"z_m": [0.4, 1.2], "lead_deg": [-20.0, 20.0], "lean_deg": [-9.0, 9.0]}, (9, 11, 13)),
    ],
)  # fmt: skip
def test_the_search_is_as_good_as_a_fine_grid(objective, free, counts):
    """Within 1 % of the best of all points of a grid, at the same places of the path."""
    task = boxed(free, objective)
    few = task.stations.chosen(np.linspace(0, task.stations.count - 1, 12).astype(int))
    screen, ranges, goal = task.screen(few), task.ranges, task.goal
    axes = [
        np.linspace(ranges.low[k], ranges.high[k], count)
        for k, count in zip(ranges.free, counts, strict=True)
    ]
    mesh = np.meshgrid(*axes)
    grid = np.tile(ranges.low, (mesh[0].size, 1))
    grid[:, ranges.free] = np.column_stack([values.ravel() for values in mesh])
    best = goal.cost(screen.figures(grid)).min()
    screen = CoarseScreen(task.screen, few, ranges, goal.demands, 1)
    found = fill_box(screen, ranges, goal, 512, 1, untold)
    found = refine_settings(screen, goal, ranges, found, 1, untold)
    assert found.cost[0] <= 1.01 * best
    # What is said of it is what it comes to.
    again = goal.cost(screen.figures(found.settings))
    np.testing.assert_allclose(again, found.cost, rtol=1e-3, atol=1e-9)
    assert np.all((found.settings >= ranges.low) & (found.settings <= ranges.high))


def figures(**changed: list) -> ScreenFigures:
    """Three settings, two gears, all well."""
    plain = {
        "reached": [True] * 3,
        "limit_margin": [1.0] * 3,
        "conditioning": [0.1] * 3,
        "rate_share": [0.5] * 3,
        "deviation": [1e-4] * 3,
        "compliance": [1e-6] * 3,
        "margin": [[50.0, 50.0]] * 3,
        "swing": [[100.0, 100.0]] * 3,
        "backlash_error": [[40e-6, 20e-6]] * 3,
        "hysteresis_error": [[0.0, 0.0]] * 3,
        "motor_share": [0.0] * 3,
    }
    return ScreenFigures(**{name: np.array(value) for name, value in (plain | changed).items()})


DEMANDS = PlaceDemands(joint_margin=0.1, conditioning=0.03, clear_share=0.25)


def test_a_gear_counts_by_how_near_its_torque_comes_to_zero():
    """Full where the sign changes, none from a quarter of the swing on, half in the middle."""
    near = figures(margin=[[-3.0, 50.0], [12.5, 0.0], [25.0, 26.0]])
    np.testing.assert_allclose(DEMANDS.exposure(near), [40e-6, 40e-6, 0.0], atol=1e-18)


@pytest.mark.parametrize(
    ("changed", "reason"),
    [
        ({"reached": [True, False, True]}, "out of reach"),
        ({"limit_margin": [1.0, 0.05, 0.1]}, "a joint too near to its limit"),
        ({"conditioning": [0.1, 0.02, 0.03]}, "too near to a singular posture"),
        ({"rate_share": [0.5, 1.1, 1.0]}, "a joint too fast"),
    ],
)
def test_a_setting_that_breaks_a_demand_is_refused_for_it(changed, reason):
    told = DEMANDS.refusals(figures(**changed))
    assert [name for name, wrong in told.items() if wrong.any()] == [reason]
    cost = PlaceObjective("both", DEMANDS, forced=True).cost(figures(**changed))
    assert np.isfinite(cost).tolist() == [True, False, True]


def test_what_is_not_known_is_refused():
    lost = figures(limit_margin=[np.nan] * 3, reached=[False] * 3, deviation=[np.nan] * 3)
    assert np.all(np.isinf(PlaceObjective("both", DEMANDS, forced=True).cost(lost)))


def test_objectives_are_displacement_exposure_and_their_sum():
    near = figures(margin=[[-3.0, 50.0]] * 3)
    costs = {name: PlaceObjective(name, DEMANDS, forced=True).cost(near)[0] for name in OBJECTIVES}
    assert costs["both"] == pytest.approx(140e-6)
    assert costs["stiffness"] == pytest.approx(100e-6, rel=1e-3)
    assert costs["backlash"] == pytest.approx(40e-6, rel=1e-2)
    unforced = PlaceObjective("stiffness", DEMANDS, forced=False)
    assert unforced.deviation(near)[0] == pytest.approx(100.0 * 1e-6)


def test_a_box_is_filled_to_its_ends_and_no_further():
    low, high = np.zeros(9), np.array([1.0, 0, 2.0, 0, 0, 0, 0, 0.5, 0])
    box = Ranges(low, high)
    points = box.sampled(1024, seed=3)
    assert [NAMES[k] for k in box.free] == ["x", "z", "base_roll"]
    np.testing.assert_allclose(points.min(axis=0), low, atol=5e-3)
    np.testing.assert_allclose(points.max(axis=0), high, atol=5e-3)
    np.testing.assert_allclose(points.mean(axis=0), 0.5 * high, atol=0.01)
    near = box.around(high, 0.5, 400, np.random.default_rng(1))
    assert np.all((near >= low) & (near <= high))


def test_a_robot_that_cannot_work_anywhere_in_the_box_is_refused_with_reasons():
    task = boxed({"x_m": [4.0, 6.0], "settings": 128, "cases": 1}, "both")
    with pytest.raises(PlanningError, match=r"got none of 128 \(out of reach: 128\): widen"):
        place(task, lambda case: case.process)


def test_the_defaults_of_the_table_are_those_of_the_page():
    table = PlaceTable()
    assert (table.settings, table.cases, table.optimise) == (100_000, 3, "both")


def test_the_best_of_a_box_are_those_of_looking_at_all_settings_everywhere(monkeypatch):
    """Bounds at three places leave out what cannot be chosen, in the box and around its best."""
    free = {"z_m": [0.4, 1.2], "lead_deg": [-20.0, 20.0], "yaw_deg": [0.0, 360.0]}
    task = boxed(free, "both")

    def best() -> tuple[FoundSettings, FoundSettings]:
        screen = CoarseScreen(task.screen, task.stations, task.ranges, task.goal.demands, 1)
        filled = fill_box(screen, task.ranges, task.goal, 2048, 1, untold)
        return filled, refine_settings(screen, task.goal, task.ranges, filled, 1, untold)

    bounded = best()
    seen = [0]

    def everywhere(self, settings, report=lambda completed: None):
        seen[0] += len(settings)
        return self.figures(settings, report)

    monkeypatch.setattr(CoarseScreen, "bounds", everywhere)
    for few, every in zip(bounded, best(), strict=True):
        np.testing.assert_array_equal(few.settings, every.settings)
        np.testing.assert_array_equal(few.cost, every.cost)
    assert seen[0] > 2048


def test_a_bound_is_not_above_the_cost_at_all_places():
    task = boxed({"x_m": [0.9, 1.9], "z_m": [0.4, 1.2], "yaw_deg": [0.0, 360.0]}, "both")
    screen = CoarseScreen(task.screen, task.stations, task.ranges, task.goal.demands, 1)
    settings = task.ranges.sampled(1024, 3)
    bound = task.goal.cost(screen.bounds(settings))
    cost = task.goal.cost(screen.figures(settings))
    assert np.isfinite(cost).sum() > 100
    assert np.all(bound <= cost * (1.0 + 1e-12))


def process_of(case):
    return case.process


@pytest.fixture(scope="module")
def whole():
    """A search that nothing stops: what is searched, and what is found."""
    task = boxed({"x_m": [0.9, 1.9], "z_m": [0.4, 1.2], "settings": 256, "cases": 1}, "stiffness")
    return task, place(task, process_of)


@pytest.mark.parametrize("stage", ["the choice of its best settings", "their refinement"])
def test_a_search_that_was_stopped_goes_on_from_its_last_stage(tmp_path, whole, stage):
    """With the settings of one that was not stopped, and without looking at those that fill the box."""
    task, found = whole
    state = SearchState(tmp_path, task)

    def stop(event):
        if isinstance(event, Progress) and event.done and state.stage == stage:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        place(task, process_of, stop, state)
    assert state.in_words.endswith("the same command goes on from there")
    told: list[str] = []
    again = SearchState(tmp_path, task)
    resumed = place(task, process_of, lambda event: told.append(event.what), again)
    assert "evaluating settings" not in told
    assert ("refining the best settings" in told) == (stage != "their refinement")
    assert resumed.best[0].content == found.best[0].content
    assert resumed.refused == found.refused
    # That of another search, and a damaged one, are none.
    other = boxed({"x_m": [0.9, 1.8], "z_m": [0.4, 1.2], "settings": 256, "cases": 1}, "stiffness")
    screen = CoarseScreen(task.screen, task.stations, task.ranges, task.goal.demands, 1)
    assert SearchState(tmp_path, other).read("their refinement", screen, other.goal) is None
    (tmp_path / STATE).write_text((tmp_path / STATE).read_text()[:-9])
    assert SearchState(tmp_path, task).read("their refinement", screen, task.goal) is None
    assert SearchState(tmp_path, task).in_words == "the search was on its way, and begins anew"
    again.forget()
    assert not (tmp_path / STATE).exists()
