"""What outputs follow at a communication point: feedthrough.py FMU STEP.

FMI 2, 2.2.8: `dependencies` of outputs are those "at the current Communication Point"; here an input is
set there and every output read again, without a step between.  STEP is 1 where the FMU declares what
outputs follow over a step.
"""

import sys

from standard import OK, Fmu

H = 0.01
fmu, over_step = Fmu(sys.argv[1]), sys.argv[2] == "1"
reals = [v for v in fmu.variables.values() if v.type in ("Real", "Float64")]
inputs = [v.name for v in reals if v.causality == "input"]
declared = {u.variable.name: {d.name for d in u.dependencies} for u in fmu.description.outputs}
of_exchange = fmu.description.modelExchange is not None


def moved(mode):
    """The robot in one mode, after a step."""
    i = fmu.instance().start(strings={"mode": mode})
    assert i.set({"force.x": 300.0, "force.z": -500.0}) == OK
    assert i.step(0.0, H)[0] == OK
    return i


def answering(i):
    """Return, by output, the inputs that change it at once."""
    found = {name: set() for name in declared}
    for known in inputs:
        (value,) = i.get(known)[1]
        before = i.get(*declared)
        assert i.set({known: value + (1e4 if known.startswith("anchor.k") else 1.0)}) == OK
        rows = zip(declared, before[1], i.get(*declared)[1], strict=True)
        for name in (name for name, was, now in rows if was != now):
            found[name].add(known)
        assert i.set({known: value}) == OK
    return found


def height(i, force):
    """Where the tool is at the end of a step under a force."""
    assert i.set({"force.z": force}) == OK
    assert i.step(H, H)[0] == OK
    return i.get("tcp.z")[1][0]


for mode in ("dynamic", "quasistatic"):
    robot = moved(mode)
    found = answering(robot)
    assert not any(found.values()), (mode, found)
    for name, known in declared.items():
        follows = known & set(inputs)
        # Of the two interfaces of a native FMU, which have one list, model exchange follows at once.
        if over_step:
            i = name[-2] if name.startswith(("motor_angle", "motor_rate")) else "1"
            assert {f"q_cmd[{i}]", f"qd_cmd[{i}]"} <= follows, name
        elif name.startswith(("compliance", "contact.f")):
            assert all(k.startswith(("q_cmd", "qd_cmd")) for k in follows) or of_exchange, name
        else:
            assert all(k.startswith(("q_cmd", "qd_cmd")) for k in follows), (name, follows)
            assert of_exchange or not follows, (name, follows)
    if of_exchange:
        other = moved(mode)
        assert other.get("tcp.z") == robot.get("tcp.z")
        slope = 0.5 * (height(other, -499.0) - height(robot, -501.0))
        assert slope > 0.0
        status, (along,) = robot.derive(["tcp.z"], ["force.z"], [1.0])
        assert abs(along / slope - 1.0) < 1e-3, (mode, slope)
