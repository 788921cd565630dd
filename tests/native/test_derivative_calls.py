"""Directional derivatives as masters ask for them: against differences, and without side effects."""

from __future__ import annotations

import fmpy
import numpy as np
import pytest
from native_fmu import POSTURE, Q_CMD, TCP, WRENCH

# What the initial state does not follow.
FROM_A_STEP_ON = ("qdd_cmd[3]", "anchor.vy", "force_rate.z", "moment_rate.y")
SPRING = [f"anchor.{c}" for c in ("x", "y", "z", "vx", "vy", "vz")]
SPRING += [f"anchor.k{c}" for c in ("xx", "xy", "xz", "yy", "yz", "zz")]


@pytest.mark.parametrize("sprung", [False, True])
@pytest.mark.parametrize("curve", ["linear", "backlash", "spline"])
@pytest.mark.parametrize("when", ["at the start", "after a step", "after a jump", "at rest"])
def test_directional_derivatives_are_those_of_the_whole_step(native, curve, when, sprung):
    """Against differences of four points through the FMU itself: other inputs from a saved state.

    The differences' own error, h^4 and rounding over h, stays below 1e-6 of the largest entry; where
    the spring throws the rounded curve about, below 1e-5.  After a step the command lies within what the
    accelerations explain, after a jump beyond it.
    """
    rates = [f"{kind}[{i}]" for kind in ("qd_cmd", "qdd_cmd") for i in range(1, 7)]
    names = [*TCP, *(f"{group}{c}" for group in ("tcp.v", "deviation.") for c in "xyz")]
    outputs = native.of(names)
    strings = {"torque_curve": curve, "mode": "quasistatic" if when == "at rest" else "dynamic"}
    slave = native.started(tolerance=1e-10, **strings)
    wrench, steps = [30.0, -20.0, -400.0, 5.0, 3.0, 1.0], (0.006, 0.004)
    if when == "at the start":
        slave = native.slave()
        slave.setupExperiment(startTime=0.0)
        slave.setString(native.of(["torque_curve"]), [curve])
        slave.enterInitializationMode()
        slave.setReal(native.of(Q_CMD), POSTURE)

        def result(inputs):
            native.set(slave, inputs)
            return np.array(slave.getReal(outputs))
    else:
        slave.setReal(native.of(WRENCH), wrench)
        if when == "after a step":
            slave.setReal(native.of(rates), [*[0.05] * 6, *[0.3] * 6])
        slave.doStep(0.0, steps[0])
        before = slave.getFMUState()

        def result(inputs):
            slave.setFMUState(before)
            native.set(slave, inputs)
            slave.doStep(steps[0], steps[1])
            return np.array(slave.getReal(outputs))

    # 0.3 rad/s^2 from 0.05 rad/s on for 6 ms lead to these, but for a smaller and a larger rest.
    q, rate, acceleration = (3.4e-4, 0.0638, 4.3) if when == "after a step" else (1e-3, 0.05, 2.3)
    values = [*wrench, *(angle + q for angle in POSTURE), *[rate] * 6, *[acceleration] * 6]
    base = dict(zip([*WRENCH, *Q_CMD, *rates], values, strict=True))
    # The spring pulls hard enough to keep all gears on their flanks.
    spring = (1.8, 0.02, 0.9, 0.1, -0.05, 0.2, 2e5, 1e4, 0.0, 1e5, 0.0, 4e5)
    base |= dict(zip(SPRING, spring, strict=True)) if sprung else {}
    base |= {"force_rate.z": -3e4, "moment_rate.y": 500.0}
    widths = {
        "force.z": 40.0,
        "moment.y": 40.0,
        "q_cmd[2]": 5e-7,
        "qd_cmd[2]": 5e-5,
        "qdd_cmd[3]": 0.4,
        "force_rate.z": 1e4,
        "moment_rate.y": 1e4,
    }
    if sprung:
        widths |= {"anchor.z": 1e-4, "anchor.vy": 1e-2, "anchor.kxx": 2e2, "anchor.kxy": 2e2}
    limit = 1e-5 if sprung and curve == "spline" else 1e-6
    for known, h in widths.items():
        if when == "at the start" and known in FROM_A_STEP_ON:
            continue
        moved = [result({**base, known: base[known] + f * h}) for f in (-2, -1, 1, 2)]
        expected = (moved[0] - 8.0 * moved[1] + 8.0 * moved[2] - moved[3]) / (12.0 * h)
        result(base)
        found = np.array(slave.getDirectionalDerivative(outputs, native.of([known]), [1.0]))
        scale = np.abs(expected).max()
        assert scale > 0.0
        np.testing.assert_allclose(found, expected, rtol=0, atol=limit * scale)


@pytest.mark.parametrize(
    ("unknown", "known", "message"),
    [
        ("force.z", "tcp.x", "expected an output to differentiate, got force.z"),
        ("tcp.x", "tcp.x", "behind initialisation, a state to differentiate by, got tcp.x"),
    ],
)
def test_derivatives_of_other_variables_are_refused(native, capfd, unknown, known, message):
    slave = native.started()
    with pytest.raises(fmpy.fmi1.FMICallException):
        slave.getDirectionalDerivative(native.of([unknown]), native.of([known]), [1.0])
    assert message in capfd.readouterr().err
