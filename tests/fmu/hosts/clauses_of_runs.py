"""Clauses of both standards that whole runs show; clauses.py has them among the others."""

import math
from ctypes import c_double, c_int
from pathlib import Path

from standard import DISCARD, ERROR, OK, WARNING

H = 0.01  # [s]


def halved_steps(fmu):
    """FMI 2, 4.2.2: after fmi2Discard "the master should retry with a shorter communication step size".

    One that takes steps of 70 ms, and halves what is discarded, comes to the end of a trajectory of
    which it does not know how long it is, and is there where one that takes small steps is."""
    if fmu.use == "me":
        return
    rows = [[0.0, *[0.0] * 6], [0.5, *[0.1, -0.1, 0.1, 0.1, 0.1, 0.1]], [0.8125, *[0.15] * 6]]
    text = "\n".join(",".join(map(repr, row)) for row in rows)
    Path("motion.csv").write_text(f"time,q1,q2,q3,q4,q5,q6\n{text}\n")
    strings = {"trajectory": str(Path("motion.csv").resolve())}
    i, small = (fmu.instance().start(strings=strings) for _ in range(2))
    time, size, discarded = 0.0, 0.07, 0
    while size > 1e-5:
        status, _ = i.step(time, size)
        if status == OK:
            time += size
            continue
        assert status == DISCARD
        discarded += 1
        size /= 2
    assert discarded > 5
    assert 0.8125 - time < 2e-5
    step = time / 100
    for k in range(100):
        assert small.step(k * step, step)[0] == OK
    found, expected = (one.get("tcp.x", "tcp.y", "tcp.z")[1] for one in (i, small))
    assert math.dist(found, expected) < 1e-6, (found, expected)


def input_derivatives(fmu):
    """FMI 2, 2.1.3: fmi2Warning, "things are not quite right, but the computation can continue. Function
    logger was called", where a derivative has no effect."""
    if fmu.version == "3" or fmu.use == "me":
        return
    i = fmu.instance(logging=True).start()
    i.log.clear()

    def derive(*names):
        orders, ones = (
            (c_int * len(names))(*[1] * len(names)),
            (c_double * len(names))(*[1.0] * len(names)),
        )
        return i.call("SetRealInputDerivatives", *i.vrs(names), orders, ones)

    assert derive("force.x", "moment.z", "anchor.y", "qdd_cmd[2]") == OK
    assert i.log == []
    for name in ("q_cmd[1]", "qd_cmd[2]", "anchor.vx", "anchor.kxy", "force_rate.z"):
        before = i.bytes()
        assert derive(name) == WARNING
        assert i.bytes() == before
        assert i.log[-1][:2] == (WARNING, b"logStatusWarning")
        assert name.encode() in i.log[-1][-1]
    assert derive("tcp.x") == ERROR


def limits(fmu):
    """FMI 2, 2.1.3: fmi2Warning, "things are not quite right, but the computation can continue", where a
    drive is told to go beyond its max: once until it is back; a trajectory when it starts."""
    i = fmu.instance(logging=True)
    top = float(fmu.variables["q_cmd[2]"].max if fmu.version == "2" else 1.0)
    assert top == 1.0
    for phase in ("instantiated", "running"):
        i.log.clear()
        assert i.set({"q_cmd[1]": 9.0, "q_cmd[2]": 1.0}) == OK, phase
        assert i.set({"q_cmd[2]": 1.5}) == WARNING, phase
        assert phase == "instantiated" or i.get("q_cmd[2]")[1] == [1.5]
        assert i.set({"q_cmd[2]": 1.6}) == OK
        assert i.set({"q_cmd[2]": 0.5}) == OK
        assert i.set({"q_cmd[2]": 0.1, "q_cmd[3]": -2.5}) == WARNING
        assert i.set({"q_cmd[3]": 0.1}) == OK
        assert [entry[:2] for entry in i.log] == [(WARNING, b"logStatusWarning")] * 2
        for entry, name in zip(i.log, (b"q_cmd[2] (upper arm", b"q_cmd[3]:"), strict=True):
            assert entry[-1].startswith(name)
            assert b"limits, -2.0 to 1.0 rad" in entry[-1]
        if phase == "instantiated":
            i.start()
    rows = "".join(f"{t},0,{q},0,0,0,0\n" for t, q in ((0, 0), (1, 1.25), (2, 0)))
    Path("beyond.csv").write_text(f"time,q1,q2,q3,q4,q5,q6\n{rows}")
    i = fmu.instance(logging=True)
    assert i.set_string("trajectory", str(Path("beyond.csv").resolve())) == OK
    assert i.enter() == OK
    assert i.call("ExitInitializationMode") == WARNING
    assert b"drive 2, -2.0 to 1.0 rad, got 1.25 rad at 1.0 s" in i.log[0][-1]


def events(fmu):
    """FMI 2, 2.2.4: a category that is listed is one of messages; a run without a fault says where it
    begins, with what was chosen, and where it ends."""
    listed = [category.name for category in fmu.description.logCategories]
    assert "logStatusFatal" not in listed
    i = fmu.instance(logging=True).start(time=0.5)
    assert fmu.use == "me" or i.step(0.5, 0.25)[0] == OK
    assert i.call("Terminate") == OK
    assert [entry[:2] for entry in i.log] == [(OK, b"logEvents")] * 2
    assert i.log[0][-1].startswith(
        b"starts at 0.5 s: dynamic, from equilibrium, torque curve backlash;"
    )
    assert i.log[1][-1] == (b"ends at 0.75 s" if fmu.use == "cs" else b"ends at 0.5 s")


def quaternion(fmu):
    """A real output that is continuous is continuous (FMI 2, 2.2.7, FMI 3, 2.4.7: variability
    "continuous"): a quaternion does not jump to its opposite where the tool has turned by 180 degrees,
    nor does the state that was saved before know another one."""
    names = [f"{body}.{c}" for body in ("tcp", "rigid") for c in ("qx", "qy", "qz", "qw")]
    i = fmu.instance().start()
    last, lowest, saved = i.get(*names)[1], 1.0, None
    assert last[3] >= 0.0
    assert last[7] >= 0.0
    for k in range(1, 51):
        angle = 0.1 * k  # of the hand: to 286 degrees
        assert i.set({"q_cmd[6]": angle, "q_cmd[4]": 0.02 * k}) == OK
        assert fmu.use == "me" or i.step(H * (k - 1), H)[0] == OK
        status, now = i.get(*names)
        assert status == OK
        for part in (slice(0, 4), slice(4, 8)):
            assert abs(math.hypot(*now[part]) - 1.0) < 1e-12
            assert math.dist(now[part], last[part]) < 0.1, (k, last, now)
        last, lowest = now, min(lowest, now[3])
        if k == 20:
            saved = i.save(), now
    assert lowest < -0.5
    state, then = saved
    assert i.restore(state) == OK
    assert i.get(*names) == (OK, then)


def tolerance(fmu):
    """FMI 2, 2.1.6, FMI 3, 2.3.2: a master's tolerance is meant "usually as relative tolerance": 1e-4 is
    not a tenth of a millimetre, and that of the default experiment is what is done without one."""
    if fmu.use == "me":
        return
    usual = fmu.description.defaultExperiment.tolerance

    def shaken(told=None, **own):
        i = fmu.instance().start(tolerance=told, **own)
        for k in range(12):
            assert i.set({"force.z": -800.0 * (k % 4 < 2)}) == OK
            assert i.step(0.02 * k, 0.02)[0] == OK
        return i.get("tcp.x", "tcp.y", "tcp.z")[1]

    plain, exact = shaken(), shaken(tcp_tolerance=1e-9)
    assert shaken(float(usual)) == shaken(tcp_tolerance=1e-6) == plain
    assert shaken(1e-4) == plain
    assert 0.0 < math.dist(plain, exact) < 1e-6
    # The model in Python is right to 1e-11 m as it is, where rounding hides what a tolerance changes.
    assert math.dist(shaken(1e-6), exact) < max(0.1 * math.dist(plain, exact), 1e-11)
    assert shaken(0.3) == shaken(1e-3) == shaken(tcp_tolerance=1e-5) != plain
    assert shaken(1e-12) == shaken(1e-7) == exact
    assert shaken(0.3, tcp_tolerance=1e-9) == exact
    i = fmu.instance()
    assert i.set({"tcp_tolerance": -1e-6}) == DISCARD
    i.start(tcp_tolerance=1e-7)
    before = i.bytes()
    assert i.set({"tcp_tolerance": 1e-6}) == ERROR
    assert i.bytes() == before
    assert i.get("tcp_tolerance") == (OK, [1e-7])
