"""[joint.balancer]: points as they stand, and the torque of a gas spring over the joint's limits."""

import numpy as np
import pinocchio as pin
import pytest
from random_urdfs import make_urdf
from two_joint_file import HEAD, JOINT, second_joint, two_joints

from coupling.files.balancer_table import MOST_POINTS
from coupling.files.robot_file import load_robot, parts_in_words
from coupling.robot.robot_edit import RobotEdit
from elastic_robot.balancers import BalancerCurve
from elastic_robot.errors import RobotFileError
from elastic_robot.robot import ElasticRobot
from elastic_robot.tool_load import Load
from elastic_robot.trajectory import HeldCommand

# A spring beside the joint of `two_joint_file`, which turns about y in the base's origin.
SPRING = {
    "base_point": [-0.4, 0.0, 0.0],
    "link_point": [0.6, 0.0, 0.3],
    "pressure_Pa": 1.2e7,
    "length_m": 1.0,
    "gas_volume_m3": 5e-3,
    "area_m2": 2e-3,
    "pulls": "true",
}
LIMITS = "stiffness = 1e6\nlimits = [-1.5, 1.2]"


def table(**changed: object) -> str:
    keys = {**SPRING, **changed}
    return "[joint.balancer.gas_spring]\n" + "".join(
        f"{key} = {value}\n" for key, value in keys.items() if value is not None
    )


def test_points_are_those_of_the_file():
    points = "torque_table = [[-1.0, 50.0], [0.0, 20.0], [0.5, -30.5]]"
    joint = second_joint("stiffness = 1e6", f"[joint.balancer]\n{points}")
    assert joint.balancer == ((-1.0, 50.0), (0.0, 20.0), (0.5, -30.5))


def work(pulls: bool, exponent: float, length: np.ndarray) -> np.ndarray:
    """Work of the gas of `SPRING` from its own length on [J], by the volume alone."""
    sign = -1.0 if pulls else 1.0
    volume = 5e-3 + sign * 2e-3 * (length - 1.0)
    if exponent == 1.0:
        return 1.2e7 * 5e-3 * np.log(volume / 5e-3)
    return 1.2e7 * 5e-3 / (1.0 - exponent) * ((volume / 5e-3) ** (1.0 - exponent) - 1.0)


@pytest.mark.parametrize("exponent", [1.0, 1.3])
@pytest.mark.parametrize("pulls", [True, False])
def test_a_gas_springs_torque_is_the_derivative_of_its_gases_work(pulls, exponent):
    """The length by the law of cosines; to 2e-6 of the largest torque, over all of the limits."""
    joint = second_joint(LIMITS, table(pulls=str(pulls).lower(), exponent=exponent))
    arm, side, offset = 0.4, np.hypot(0.6, 0.3), np.arctan2(0.3, 0.6)

    def length(angle: np.ndarray) -> np.ndarray:
        # About y an angle turns x towards -z: the link's point is at `offset` above x at 0.
        return np.sqrt(arm**2 + side**2 + 2.0 * arm * side * np.cos(offset - angle))

    angle, h = np.linspace(-1.5, 1.2, 777), 1e-5
    change = work(pulls, exponent, length(angle + h)) - work(pulls, exponent, length(angle - h))
    torque = change / (2.0 * h)
    found = BalancerCurve.through(joint.balancer).torque(angle)
    np.testing.assert_allclose(found, torque, rtol=0, atol=2e-6 * np.abs(torque).max())
    assert (joint.balancer[0][0], joint.balancer[-1][0]) == (-1.5, 1.2)
    assert 9 <= len(joint.balancer) <= MOST_POINTS
    assert np.abs(torque).max() > 1e3


@pytest.mark.parametrize("seed", range(8))
def test_beside_a_urdf_the_points_are_in_its_links_frames(tmp_path, seed):
    """The spring's length is that between the two points in Pinocchio's own reading of the URDF."""
    urdf = make_urdf(seed, 4)
    (tmp_path / "robot.urdf").write_text(urdf.plain)
    rng = np.random.default_rng(seed)
    base, link = rng.uniform(-1.0, 1.0, (2, 3))
    number = 1 + seed % 4
    name = urdf.joints[number - 1]
    points = table(base_point=base.tolist(), link_point=link.tolist(), gas_volume_m3=10.0)
    (tmp_path / "robot.toml").write_text(
        'name = "r"\n[urdf]\nfile = "robot.urdf"\nbase = "base_link"\n[tcp]\nlink = "tool"\n'
        f'[[joint]]\nname = "{name}"\nstiffness = 1e7\nlimits = [-1.0, 1.0]\n{points}'
    )
    robot = load_robot(tmp_path / "robot.toml")
    model = pin.buildModelFromUrdf(str(tmp_path / "robot.urdf"))
    data, joint = model.createData(), model.getJointId(name)

    def length(angle: float) -> float:
        step = np.zeros(model.nv)
        step[model.joints[joint].idx_v] = angle
        pin.forwardKinematics(model, data, pin.integrate(model, pin.neutral(model), step))
        before = model.parents[joint]
        if number == 1:
            pin.updateFramePlacements(model, data)
            before_placement = data.oMf[model.getFrameId("base_link")]
        else:
            before_placement = data.oMi[before]
        return float(np.linalg.norm(data.oMi[joint].act(link) - before_placement.act(base)))

    curve = BalancerCurve.through(robot.joints[number - 1].balancer)
    for angle in (-0.7, 0.2, 0.9):
        here, above, below = length(angle), length(angle + 1e-6), length(angle - 1e-6)
        # It pulls, at a nearly constant pressure, as 10 m^3 hardly change.
        pressure = 1.2e7 * 10.0 / (10.0 - 2e-3 * (here - 1.0))
        expected = -2e-3 * pressure * (above - below) / 2e-6
        assert curve.torque(np.array(angle)) == pytest.approx(expected, abs=3e-2)


def test_an_unloaded_gear_rests_where_the_spring_carries_its_link(tmp_path):
    """A file's robot at rest: the gear carries weight less the spring's torque."""
    file = two_joints(tmp_path, LIMITS, table(gas_volume_m3=0.05))
    robot = load_robot(file)
    stiffness, weight = 1e6, 10.0 * 9.81 * 0.5
    model = ElasticRobot(robot, "linear")
    still = HeldCommand(0.0, np.array([0.0, -0.3]), np.zeros(2), np.zeros(2))
    model.reset(0.0, still, Load())
    sag, first = model.deflection()[1], model.deflection()[0]
    angle = -0.3 + sag
    spring = BalancerCurve.through(robot.joints[1].balancer).torque(np.array(angle))
    own = weight * np.cos(first + angle)  # about y, gravity turns x towards -z
    assert stiffness * sag == pytest.approx(own + float(spring), rel=1e-9)


MISTAKES = {
    "folds": (
        table(base_point=[0.6, 0.0, 0.3]),
        "gas_spring: expected a length > 0 [m] over the joint's limits, got",
    ),
    "no volume left": (
        table(gas_volume_m3=2e-5),
        "gas_spring: expected a volume of its gas > 0 [m^3] over the joint's limits, got",
    ),
    "on the axis": (
        table(base_point=[0.0, 1.0, 0.0]),
        "gas_spring: expected points beside the joint's axis, got ones about which the spring turns",
    ),
    "too sharp": (
        table(base_point=[0.6, 0.004, 0.3]),
        "gas_spring: expected a torque that 256 points over the joint's limits interpolate",
    ),
    "both": (
        "[joint.balancer]\ntorque_table = [[0.0, 1.0], [1.0, 0.0], [2.0, 0.0]]\n" + table(),
        "expected either torque_table or gas_spring, got both",
    ),
    "neither": ("[joint.balancer]", "expected either torque_table or gas_spring, got neither"),
    "no pressure": (table(pressure_Pa=None), "gas_spring: key 'pressure_Pa' is missing"),
    "no way": (table(pulls=None), "gas_spring: key 'pulls' is missing"),
    "negative area": (table(area_m2=-1.0), "gas_spring: area_m2: expected a number greater than 0"),
    "stiffer than the gear": (
        "[joint.balancer]\ntorque_table = [[0.0, 0.0], [0.1, 2e5], [0.2, 3e5]]",
        "balancer: expected torques that rise by less than the gear's 1e+06 N m/rad",
    ),
    "falling angles": (
        "[joint.balancer]\ntorque_table = [[0.0, 0.0], [0.1, 2e3], [0.1, 3e3]]",
        "balancer: expected strictly rising angles, got no rise behind 0.1 rad",
    ),
}


@pytest.mark.parametrize("mistake", MISTAKES)
def test_what_no_balancer_can_be_is_refused_in_one_sentence(tmp_path, mistake):
    text, said = MISTAKES[mistake]
    file = two_joints(tmp_path, LIMITS, text)
    with pytest.raises(RobotFileError) as caught:
        load_robot(file)
    assert str(caught.value).startswith(f"{file}: joint 2: balancer: ".removesuffix("balancer: "))
    assert said in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("joint", "said"),
    [
        ("limits = [-1.0, 1.0]", "balancer: expected a stiffness beside it, got none"),
        (
            "stiffness = 1e6",
            "balancer: gas_spring: expected limits of the joint beside it, got none",
        ),
    ],
)
def test_what_a_balancer_needs_of_its_joint_is_said(tmp_path, joint, said):
    with pytest.raises(RobotFileError, match=said):
        load_robot(two_joints(tmp_path, joint, table()))


def test_robots_lists_it_and_a_written_file_keeps_it(tmp_path, command):
    file = tmp_path / "robot.toml"
    file.write_text(
        f"{HEAD}{JOINT}{LIMITS}\n\n{table()}\n[sources]\n'joint.balancer' = 'a sheet'\n"
    )
    before = load_robot(file)
    (words,) = parts_in_words(file)
    assert words == "joint[1].balancer: a gas spring that pulls with 2.4e+04 N at 1 m"
    told = command("robots", file).stdout
    assert words in " ".join(told.split())
    assert "joint[1].balancer.gas_spring.pulls = true: a sheet" in " ".join(told.split())
    edit = RobotEdit(file, before)
    edit.change("joint[1].stiffness", 2e6, "fitted")
    file.write_text(edit.text("Fitted.", file))
    assert table() in file.read_text()
    after = load_robot(file).joints[0]
    assert (after.stiffness, after.balancer) == (2e6, before.joints[0].balancer)
