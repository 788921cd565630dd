"""The benchmark of evaluations: what it compares with is right, its verdicts follow from its rows."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.evaluation_tasks import (
    PRESSED,
    TASKS,
    oblique_wall,
    on_a_wall,
)
from benchmarks.evaluations import (
    SCHEMES_RUN,
    STATED,
    CouplingRow,
    Reference,
    measured,
)
from coupling.path.contact_spring import ContactSpring
from coupling.path.histories import WrenchHistory
from coupling.run.fmu_pool import FmuPool


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


def row(scheme=STATED, gain=1.0, errors=(1e-3, 5e-7), **changes) -> CouplingRow:
    plain = CouplingRow(
        "wall", "dynamic", scheme, gain, errors, 0, False, True, "converged", 3, 0.1
    )
    return replace(plain, **changes)
