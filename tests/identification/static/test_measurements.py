"""measurements.csv: what is read or refused; and plans of what to measure."""

from dataclasses import replace

import numpy as np
import pytest
from noisy_arm import arm, noisy

from coupling.errors import IdentifyError
from coupling.identification.intervals import intervals
from coupling.identification.static.elastic import ElasticParameters
from coupling.identification.static.fit import IdentifyOptions, fit_static
from coupling.identification.static.measurements import noise_of, read_measurements
from coupling.identification.static.model import StaticModel
from coupling.identification.static.plan import (
    PlanRequest,
    _candidates,
    _information_rows,
    _noise,
    planned,
)

HEADER = "q1,q2,fx,fy,fz,dx,dy,dz"
ROW = "0.1,-0.2,10,20,-300,1e-4,2e-4,-3e-3"
WISH = PlanRequest(count=8, force=400.0, poses=64, position=1e-5)


def read(tmp_path, text: str | bytes, joints: int = 2):
    file = tmp_path / "measured.csv"
    file.write_bytes(text if isinstance(text, bytes) else text.encode())
    return read_measurements(file, joints)


def test_a_plain_table_is_measured_at_the_tcp_without_deviations(tmp_path):
    found = read(tmp_path, f"{HEADER}\n{ROW}\n{ROW}\n")
    assert found.names == ("line 2", "line 3")
    np.testing.assert_array_equal(found.q, [[0.1, -0.2]] * 2)
    np.testing.assert_array_equal(found.wrench, [[10, 20, -300, 0, 0, 0]] * 2)
    np.testing.assert_array_equal(found.deflection, [[1e-4, 2e-4, -3e-3]] * 2)
    assert not found.load_point.any()
    assert not found.measured_point.any()
    assert np.isnan(found.deflection_deviation).all()


def test_marks_of_windows_comments_quotes_and_other_columns_do_no_harm(tmp_path):
    text = (
        "\ufeff# measured on a Friday\r\n\r\n"
        " when ,name,q1, q2,fx,fy,fz,dx,dy,dz,q3\r\n"
        f'noon,"left, low",{ROW},9\r\n  # the cable slipped here\r\n'
        f"one,,{ROW},not a number\r\n"
    )
    found = read(tmp_path, text)
    assert found.names == ("left, low", "line 6")
    np.testing.assert_array_equal(found.deflection[1], [1e-4, 2e-4, -3e-3])
    assert found.remarks == ("columns q3 are not used: the robot has 2 joints",)


def test_moments_rotations_points_and_deviations_are_read_where_they_are(tmp_path):
    more = "mx,my,mz,drx,dry,drz,load.x,load.y,load.z,point.x,point.y,point.z,sd.dx,sd.fz"
    found = read(tmp_path, f"{HEADER},{more}\n{ROW},1,2,3,4,5,6,7,8,9,10,11,12,0.5,2\n")
    np.testing.assert_array_equal(found.wrench, [[10, 20, -300, 1, 2, 3]])
    np.testing.assert_array_equal(found.deflection, [[1e-4, 2e-4, -3e-3, 4, 5, 6]])
    np.testing.assert_array_equal(found.load_point, [[7, 8, 9]])
    np.testing.assert_array_equal(found.measured_point, [[10, 11, 12]])
    assert found.deflection_deviation[0, 0] == 0.5
    assert np.isnan(found.deflection_deviation[0, 1:]).all()
    assert found.wrench_deviation[0, 2] == 2.0


# What the file holds, and what the message must say.
MISTAKES = {
    "nothing": ("", ["at least one row", "0 lines"]),
    "names only": (f"{HEADER}\n", ["at least one row", "1 lines"]),
    "a missing column": (f"{HEADER[:-3]}\n{ROW[:-6]}\n", ["dz", "missing"]),
    "another robot": (f"q1,{HEADER[6:]}\n{ROW[4:]}\n", ["q2", "missing"]),
    "semicolons": (
        f"{HEADER}\n{ROW}\n".replace(",", ";"),
        ["missing", "separate them with commas"],
    ),
    "a column twice": (f"{HEADER},fx\n{ROW},1\n", ["one column 'fx'", "two"]),
    "half a loop": (f"{HEADER},loop\n{ROW},1.5\n{ROW},1.5\n", ["line 2: loop", "whole number"]),
    "a loop of one row": (
        f"{HEADER},loop\n{ROW},1\n{ROW},1\n{ROW},2\n",
        ["line 4: loop", "two rows or more"],
    ),
    "loops that are mixed": (
        f"{HEADER},loop\n" + "".join(f"{ROW},{n}\n" for n in (1, 1, 2, 2, 1, 1)),
        ["line 6: loop", "one after the other"],
    ),
    "one loop": (f"{HEADER},loop\n{ROW},1\n{ROW},1\n", ["loop", "two loops or more"]),
    "a loop that moves": (
        f"{HEADER},loop\n{ROW},1\n{ROW.replace('0.2', '0.3')},1\n{ROW},2\n{ROW},2\n",
        ["line 3: q2", "as in the first row of its loop, -0.2"],
    ),
    "half a moment": (f"{HEADER},mx\n{ROW},1\n", ["mx, my, mz", "or none", "got mx"]),
    "half a rotation": (f"{HEADER},drx,drz\n{ROW},1,1\n", ["drx, dry, drz", "or none"]),
    "half a point": (f"{HEADER},load.y\n{ROW},1\n", ["load.x, load.y, load.z"]),
    "NaN": (f"{HEADER}\n{ROW}\nnan{ROW[3:]}\n", ["line 3", "q1", "finite number", "'nan'"]),
    "infinity": (f"{HEADER}\n-inf{ROW[3:]}\n", ["line 2", "q1", "'-inf'"]),
    "a number beyond all": (f"{HEADER}\n1e300{ROW[3:]}\n", ["line 2", "1e300"]),
    "a word": (f"{HEADER}\n# c\n{ROW[:-4]}much\n", ["line 3", "dz", "much'"]),
    "an empty cell": (f"{HEADER}\n{ROW[:-5]}\n", ["line 2", "dz", "''"]),
    "a short row": (f"{HEADER}\n{ROW[4:]}\n", ["line 2", "8 cells", "got 7"]),
    "a long row": (f"{HEADER}\n{ROW},1\n", ["line 2", "8 cells", "got 9"]),
    "a negative deviation": (f"{HEADER},sd.dy\n{ROW},-1\n", ["sd.dy", ">= 0", "-1"]),
    "an open quote": (f'{HEADER},name\n{ROW},"left\n{ROW},"right"\n', ["CSV"]),
    "bytes": (bytes(range(256)), ["cannot be read"]),
}


@pytest.mark.parametrize("mistake", MISTAKES)
def test_a_mistake_is_refused_with_its_place(tmp_path, mistake):
    text, words = MISTAKES[mistake]
    with pytest.raises(IdentifyError) as caught:
        read(tmp_path, text)
    message = str(caught.value)
    assert message.startswith(str(tmp_path / "measured.csv"))
    assert "\n" not in message
    assert [word for word in words if word not in message] == []


def test_a_file_that_is_not_there_is_refused(tmp_path):
    with pytest.raises(IdentifyError, match="cannot be read"):
        read_measurements(tmp_path / "none.csv", 2)
    with pytest.raises(IdentifyError, match="cannot be read"):
        read_measurements(tmp_path, 2)


def limited(robot):
    joints = tuple(replace(joint, limits=(-1.0, 0.5)) for joint in robot.joints)
    return replace(robot, joints=joints)


def test_a_plan_keeps_to_limits_and_is_better_than_random_choices():
    robot = limited(arm(tilt=True))
    plan = planned(robot, "backlash", WISH)
    own = plan.measurements
    assert own.count == 8
    assert own.q.min() >= -1.0
    assert own.q.max() <= 0.5
    np.testing.assert_allclose(np.linalg.norm(own.wrench[:, :3], axis=1), 400.0)
    elasticity = ElasticParameters.of(robot, "backlash")
    candidates = _candidates(robot, WISH)
    rows = _information_rows(elasticity, candidates, _noise(candidates.count, WISH))
    chosen = _information_rows(elasticity, own, _noise(8, WISH))

    def gain(some):
        return np.linalg.slogdet(np.einsum("krp,krq->pq", some, some))[1]

    rng = np.random.default_rng(0)
    random = [gain(rows[rng.choice(len(rows), 8)]) for _ in range(200)]
    assert gain(chosen) > max(random) + 0.5


def test_the_interval_promised_is_the_one_that_measurements_give():
    """Median over 8 noisy repetitions of the plan; the jackknife makes some wider, none narrower."""
    robot, rng = limited(arm()), np.random.default_rng(1)
    plan = planned(robot, "backlash", replace(WISH, count=20))
    elasticity = ElasticParameters.of(robot, "backlash")
    model = StaticModel(elasticity, plan.measurements, "backlash")
    right = replace(plan.measurements, deflection=model.predict(elasticity.start).deflection)
    halves = []
    for _ in range(8):
        rows = noisy(right, rng, 1e-5, 5.0)
        fit = fit_static(elasticity, rows, IdentifyOptions(noise_of(rows)))
        found = intervals(fit.experiment.linear, fit.experiment.weight, fit.x, is_noise_known=False)
        halves.append((found.high - found.low) / 2.0 / elasticity.start)
    promised = np.array([entry.after for entry in plan.expected])
    ratio = np.median(halves, axis=0) / promised
    assert np.all((ratio > 0.8) & (ratio < 1.6))


def test_what_is_measured_already_counts():
    robot = limited(arm())
    first = planned(robot, "backlash", WISH).measurements
    more = planned(robot, "backlash", replace(WISH, count=4), (first, _noise(8, WISH)))
    before, after = (
        np.array([getattr(entry, name) for entry in more.expected]) for name in ("before", "after")
    )
    assert np.all(after < before)
    assert np.all(np.isfinite(before))
    alone = planned(robot, "backlash", replace(WISH, count=4))
    assert all(np.isinf(entry.before) for entry in alone.expected)


def test_weights_hang_down_and_tools_stay_above_the_floor():
    plan = planned(limited(arm()), "backlash", replace(WISH, down=True, lowest=1.0))
    np.testing.assert_array_equal(plan.measurements.wrench[:, 2], -400.0)
    with pytest.raises(IdentifyError, match="above 9 m"):
        planned(limited(arm()), "backlash", replace(WISH, lowest=9.0))
