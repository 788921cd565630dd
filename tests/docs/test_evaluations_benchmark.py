"""The benchmark of evaluations: what it compares with is right, its verdicts follow from its rows."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from benchmarks import evaluation_methods, evaluations
from benchmarks.evaluation_tasks import (
    LONG,
    PRESSED,
    TASKS,
    Withheld,
    hanging_cases,
    oblique_wall,
    on_a_wall,
)
from benchmarks.evaluations import (
    SCHEMES_RUN,
    STATED,
    WITHHELD,
    Counted,
    CouplingRow,
    Reference,
    goals,
    grid,
    lines,
    measured,
)
from coupling.path.contact_spring import ContactSpring
from coupling.path.histories import WrenchHistory
from coupling.run.fmu_pool import FmuPool
from coupling.solve import Mirror


def springs(name):
    """The tasks of a tool on springs, which simulate no FMU."""
    return list(TASKS[name](FmuPool("python")))


@pytest.mark.parametrize("name", ["springs", "lost"])
def test_the_reference_of_a_tool_on_springs_is_the_closed_form(name):
    """x = u + C n k p, p = p_u / (1 + gain) the penetration where the tool is inside."""
    wall = oblique_wall()
    for task in springs(name):
        free, along = task.command.q[0], task.robot.compliance @ wall.normal
        assert wall.stiffness * wall.normal @ along == pytest.approx(task.gain, rel=1e-12)
        pressed = np.maximum(-free @ wall.normal, 0.0) / (1.0 + task.gain)
        expected = free + wall.stiffness * pressed[:, None] * along
        found = Reference.of(task)
        np.testing.assert_allclose(found.path.position[0], expected, rtol=0, atol=1e-12)
        assert found.known
        lost = np.count_nonzero(pressed == 0.0)
        assert (lost > 10) == (name == "lost")


def test_the_reference_of_the_pressed_robot_is_a_spring_inside_it():
    """A wall that is never left is a spring to its plane: one simulation, without an iteration."""
    with FmuPool("native") as models:
        (task, _) = on_a_wall(models, "wall", PRESSED, (5.0,), 0.05)
        found = Reference.of(task)
        time, wall = task.desired.time, task.process
        anchor = found.path.position.copy()
        anchor[..., 2] = wall.point[2]
        stiffness = wall.stiffness * np.outer(wall.normal, wall.normal)
        springs = ContactSpring(anchor, np.tile(stiffness, (1, len(time), 1, 1)))
        load = WrenchHistory(time, np.zeros((1, len(time), 6)), springs)
        inside = task.robot.simulate(task.command, load, "quasistatic")
    assert np.all(wall.evaluate(inside).wrench.force[0, :, 2] > 50.0)  # never left
    np.testing.assert_allclose(found.path.position, inside.position, rtol=0, atol=1e-9)


def test_noise_is_the_same_at_the_same_place():
    task = springs("noise")[0]
    wrench = task.process.evaluate(task.desired).wrench
    np.testing.assert_array_equal(wrench.wrench, task.process.evaluate(task.desired).wrench.wrench)
    smooth = oblique_wall().evaluate(task.desired).wrench
    off = np.linalg.norm(wrench.force - smooth.force, axis=-1) / smooth.peak_force
    assert 0.01 < off.max() < 0.03


@pytest.mark.parametrize("scheme", SCHEMES_RUN)
def test_every_scheme_is_measured_and_what_it_says_is_checked(scheme):
    task = springs("springs")[0]
    row = measured(task, scheme, Reference.of(task))
    assert row.good
    assert row.simulations == row.evaluations + 1
    assert 1 <= row.enough <= row.evaluations
    # With a reference that is 2 um off what it finds is another solution, everywhere.
    moved = Reference.of(task)
    aside = moved.path.displaced(np.array([2e-6, 0.0, 0.0, 0.0, 0.0, 0.0]))
    other = measured(task, scheme, replace(moved, path=aside))
    assert other.converged
    assert other.elsewhere
    assert other.beyond == len(task.desired.time)
    assert other.enough is None


def test_what_is_withheld_is_not_stated():
    task = springs("springs")[0]
    assert task.process.evaluate(task.desired).stiffness is not None
    assert Withheld(task.process).evaluate(task.desired).stiffness is None


def test_a_method_is_measured_with_all_its_simulations():
    case = hanging_cases()["KUKA with backlash, cone"]
    with FmuPool("native") as models:
        cell, _ = evaluation_methods.cell_of(case.robots, models)
        method = Mirror(max_passes=1)
        row = evaluation_methods.corrected("cone", case, cell, "quasistatic", method, STATED)
    # Every evaluation is followed by a simulation, the unloaded robot comes first.
    assert row.simulations == row.evaluations + 1
    assert 0.0 < row.left < 1e-3
    assert "| cone | mirror | quasistatic | robin, K stated |" in evaluation_methods.lines([row])


def row(scheme=STATED, gain=1.0, errors=(1e-3, 5e-7), **changes) -> CouplingRow:
    plain = CouplingRow(
        "wall", "dynamic", scheme, gain, errors, 0, False, True, "converged", 3, 0.1
    )
    return replace(plain, **changes)


def test_goals_take_no_scheme_at_its_word():
    found = goals(
        [
            row(),
            row(errors=(1e-3, 2e-6)),
            row(errors=(1e-3, 2e-6), elsewhere=True),
            row(errors=(np.nan, np.nan)),
            row(errors=(1e-3,) * 3 + (1e-8,)),
            row(WITHHELD, 5.0, (1e-3,) * 3 + (1e-8,)),
            row(converged=False, outcome="stagnated"),
            row(WITHHELD, 10.0),
            row(WITHHELD, None),
            row("anderson"),
        ]
    )
    assert [goal.reached for goal in found] == [True, False, True, False, False, True, False]
    assert "off by 2 um" in str(found[1])
    assert "(at most 4; reached)" in str(found[5])
    assert "stagnated" in str(found[6])


def test_evaluations_are_enough_where_the_path_stays_right():
    assert row(errors=(1e-3, 1e-8, 1e-3, 1e-8, 1e-9)).enough == 4
    assert row(errors=(1e-8, 1e-3)).enough is None
    assert row(errors=(np.nan,)).enough is None


def test_tables_tell_what_is_wrong():
    every = [row(scheme) for scheme in SCHEMES_RUN[1:]]
    text = grid([row(errors=(1e-3, 3.3e-5), beyond=7), *every])
    assert text.splitlines()[-1] == "| wall | dynamic | 2 (off by 33 um at 7) | 2 | 2 | 2 | 2 |"
    assert (
        lines(every).splitlines()[-1].startswith("| wall | dynamic | anderson | 2 | 2 | 3 | 0.5 |")
    )


def test_what_takes_long_runs_only_where_it_is_named(monkeypatch):
    begun = []
    monkeypatch.setattr(evaluations, "rows", lambda names: begun.extend(names) or iter(()))
    evaluations.main([])
    assert begun
    assert not set(begun) & set(LONG)
    evaluations.main(["cone_fem"])
    assert begun[-1] == "cone_fem"
    with pytest.raises(SystemExit, match="expected tasks out of"):
        evaluations.main(["cones"])


def test_robots_are_counted_one_by_one():
    task = springs("springs")[0]
    robot = Counted(task.robot)
    robot.simulate(task.command, WrenchHistory.none(task.desired.time, 1), "quasistatic")
    assert robot.count == 1
