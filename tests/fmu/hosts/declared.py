"""What modelDescription.xml declares to follow something, asked for: declared.py FMU USE [DRIVE].

FMI 2, 2.2.8, FMI 3, 2.4.8: knowns of an initial unknown are "inputs", "variables with initial = exact"
and the "independent variable"; of outputs and state derivatives inputs, "continuous states", in FMI 3
"parameters", and the independent variable.  Each derivative is answered and is the slope of the values
that the FMU itself has; what is not declared has none: "if the known is not listed among the
dependencies then the partial derivative of the unknown with respect to that known is identically
zero".
"""

import math
import sys
from pathlib import Path

from standard import OK, POSTURE, Fmu

H, TIME = 0.004, "time"
SIZES = {  # of a change that shows a slope
    "stiffness": 10.0,
    "damping": 1.0,
    "backlash": 1e-8,
    "gravity": 1e-3,
    "force": 1.0,
    "moment": 1.0,
    "force_rate": 100.0,
    "moment_rate": 100.0,
    "anchor.k": 10.0,
    "contact.dissipation": 1e-3,
    "contact.friction": 1e-4,
    "contact.slip_speed": 1e-5,
    "contact.n": 1e-5,
    "qdd_cmd": 1e-2,
    "qd_cmd": 1e-5,
    "deflection_rate": 1e-5,
    "hysteresis": 1e-3,
    TIME: 1e-5,
}
# Of values, which a slope has over the size of its change.
ROUNDING = {"der(deflection_rate": 1e-8, "compliance": 1e-20, "contact": 1e-10}
# Some units in the last place of 1e4 N m, and of wind-ups of 1 mrad times 1e7 N m/rad.
ROUNDING |= {"gear_torque": 2e-10, "motor_torque": 2e-10, "servo_integral": 1e-10}
ROUNDING |= {"der(rotor_rate": 1e-9, "der(servo_integral": 1e-8}
ACTING = {
    "force.x": 300.0,
    "force.y": -200.0,
    "force.z": -500.0,
    "moment.x": 40.0,
    "moment.y": 30.0,
}
ACTING |= {"moment.z": 25.0, "anchor.x": 1.5, "anchor.z": 0.9, "anchor.vy": 0.1}
ACTING |= {"anchor.kxx": 1e5, "anchor.kyy": 2e5, "anchor.kzz": 1e5, "anchor.kxy": 1e4}
# A sphere deep in a soft plane through the anchor.
ACTING |= {"contact.stiffness": 1e4, "contact.dissipation": 0.5, "contact.radius": 0.15}
ACTING |= {
    "contact.friction": 0.2,
    "contact.slip_speed": 0.05,
    "contact.nx": 0.2,
    "contact.nz": -2.0,
}


def size_of(name):
    base = name.split("[")[0].split(".")[0]
    for key in (name, name.split(".")[-1], base, name[:8], name[:9]):
        if key in SIZES:
            return SIZES[key]
    return 1e-6


class Declared:
    """An FMU with what its description says."""

    def __init__(self, file, use):
        self.fmu, self.use, d = Fmu(file, use), use, None
        d = self.fmu.description
        self.variables = [v.name for v in d.modelVariables if v.type in ("Real", "Float64")]
        told = [*d.derivatives, *d.eventIndicators]
        self.outputs = [*d.outputs, *(told if use == "me" else [])]
        self.initial = [u for u in d.initialUnknowns if u.variable.name in self.variables]
        causality = {v.name: v.causality for v in d.modelVariables}
        self.inputs = [n for n in self.variables if causality[n] == "input"]
        tunable = {v.name for v in d.modelVariables if v.variability == "tunable"}
        self.parameters = [n for n in self.variables if n in tunable]
        self.states = [
            n for n in self.variables if n.split("[")[0] in ("deflection", "deflection_rate")
        ]

    def check(self, unknowns, knowns, i, slope, limit):
        """Derivatives against slopes of the FMU's values, relative to the largest of their kind."""
        names = [u.variable.name for u in unknowns]
        declared = {u.variable.name: {d.name for d in u.dependencies} for u in unknowns}
        rows_of = {}
        for k, name in enumerate(names):
            kind = name.split("[")[0].split(".")[0], self.fmu.variables[name].unit
            rows_of.setdefault(kind, []).append(k)
        # FMI 2 has no parameters among the knowns of outputs: they are answered all the same.
        knows = self.fmu.version == "3" or unknowns is self.initial
        checked = 0
        for known in knowns:
            status, found = i.derive(names, [known], [1.0])
            assert status == OK, (known, i.log)
            for name, value in zip(names, found, strict=True):
                told = known in declared[name] or (known in self.parameters and not knows)
                assert value == 0.0 or told, (name, known, value)
            expected, size = slope(known, names), size_of(known)
            for (base, _), rows in rows_of.items():
                scale = max(abs(expected[k]) for k in rows)
                most = limit * scale + ROUNDING.get(base, 1e-14) / size
                for k in rows:
                    right = abs(found[k] - expected[k]) <= most
                    assert right, (names[k], known, found[k], expected[k], scale)
                    checked += 1
        assert checked > 100
        return checked


def slopes(measure, known, names):
    """Differences of four points through `measure(known, change)`."""
    size = size_of(known)
    far, near, up, high = (measure(known, factor * size, names) for factor in (-2, -1, 1, 2))
    rows = zip(far, near, up, high, strict=True)
    return [(a - 8.0 * b + 8.0 * c - d) / (12.0 * size) for a, b, c, d in rows]


def motion():
    """A trajectory of all joints: cubic in time, its rates and accelerations with it."""
    rows = ["time," + ",".join(f"{kind}{j}" for kind in ("q", "qd", "qdd") for j in range(1, 7))]
    for k in range(9):
        t = 0.05 * k
        q = [0.3 * t + 0.2 * j * t**2 + t**3 + list(POSTURE.values())[j] for j in range(6)]
        qd = [0.3 + 0.4 * j * t + 3.0 * t**2 for j in range(6)]
        qdd = [0.4 * j + 6.0 * t for j in range(6)]
        rows.append(",".join(map(repr, [t, *q, *qd, *qdd])))
    path = Path("motion.csv").resolve()
    path.write_text("\n".join([*rows, ""]))
    return str(path)


def start_of(d, strings, time=0.05, tolerance=1e-11, end=True):
    i = d.fmu.instance()
    for name, text in strings.items():
        assert i.set_string(name, text) == OK
    assert i.enter(time) == OK
    assert i.set({"tcp_tolerance": tolerance, **POSTURE, **ACTING}) == OK
    assert not end or i.exit() == OK
    return i


def initial(d, strings):
    i = start_of(d, strings, end=False)

    def measure(known, change, names):
        if known == TIME:
            return start_of(d, strings, 0.05 + change, end=False).get(*names)[1]
        before = i.get(known)[1][0]
        assert i.set({known: before + change}) == OK
        status, values = i.get(*names)
        assert status == OK
        assert i.set({known: before}) == OK
        return values

    knowns = [*d.inputs, *d.parameters, TIME]
    return d.check(d.initial, knowns, i, lambda k, n: slopes(measure, k, n), 1e-5)


def exchange(d, strings):
    """In event mode, where all knowns may be set."""
    i = start_of(d, strings)
    m = i.count("deflection")
    _, states = i.get(*d.states)
    moved = {
        n: x + 1e-4 * math.sin(k) for k, (n, x) in enumerate(zip(d.states, states, strict=True))
    }
    assert i.set({**moved, "qd_cmd[2]": 0.1, "qdd_cmd[3]": 0.2}) == OK
    assert m > 5

    def measure(known, change, names):
        before = i.get(known)[1][0]
        act = i.set_time if known == TIME else lambda value: i.set({known: value})
        assert act(before + change) == OK
        status, values = i.get(*names)
        assert status == OK
        assert act(before) == OK
        return values

    knowns = [*d.inputs, *d.states, *d.parameters, TIME]
    return d.check(d.outputs, knowns, i, lambda k, n: slopes(measure, k, n), 1e-6)


def stepped(d, strings, jump=0.0):
    """Of the whole step by inputs and parameters; at its end by states and time.

    The command lies within what its rates explain, or jumps beyond it [rad].
    """
    i = start_of(d, strings)
    quiet = {"qd_cmd[2]": 0.1, "qd_cmd[5]": -0.2}
    assert i.set(quiet) == OK
    assert i.step(0.05, H)[0] == OK
    rates = {name: quiet.get(name.replace("q_", "qd_"), 0.0) for name in POSTURE}
    moved = {name: q + H * rates[name] + jump for name, q in POSTURE.items()}
    assert i.set({**moved, "force.z": -400.0, "force_rate.x": 1e3}) == OK
    before = i.save()

    def measure(known, change, names):
        assert i.restore(before) == OK
        value = i.get(known)[1][0]
        assert i.set({known: value + change}) == OK
        assert i.step(0.05 + H, H)[0] == OK
        return i.get(*names)[1]

    assert (
        i.set({"gravity.z": i.get("gravity.z")[1][0]}) == OK
    )  # parameters are taken with the step
    before = i.save()
    assert i.step(0.05 + H, H)[0] == OK
    knowns = [*d.inputs, *d.parameters]

    def slope(known, names):
        after = i.save()
        found = slopes(measure, known, names)
        assert i.restore(after) == OK
        return found

    # Where friction slips, steps of other lengths differ by more than their derivatives.
    limit = 1e-4 if strings["drive"] == "ideal" else 1e-3
    checked = d.check(d.outputs, knowns, i, slope, limit)
    names = [u.variable.name for u in d.outputs]
    for known in [*d.states, TIME]:
        status, found = i.derive(names, [known], [1.0])
        assert status == OK, known
        for u, value in zip(d.outputs, found, strict=True):
            assert value == 0.0 or known in {o.name for o in u.dependencies}, (u, known)
    # The elastic tool and the rigid one move alike by an elastic angle and by its drive's.
    _, by_state = i.derive(["tcp.x", "tcp.y", "tcp.z"], ["deflection[1]"], [1.0])
    assert math.hypot(*by_state) > 0.1
    return checked


if __name__ == "__main__":
    d, drive = Declared(sys.argv[1], sys.argv[2]), (*sys.argv[3:], "ideal")[0]
    for curve in ("linear", "spline", "backlash"):
        commanded = {"torque_curve": curve, "drive": drive}
        along = [] if drive == "torque" else [{**commanded, "trajectory": motion()}]
        for strings in (commanded, *along):
            print(curve, "initial", initial(d, strings), flush=True)
            if sys.argv[2] == "me":
                print(curve, "exchange", exchange(d, strings), flush=True)
        if sys.argv[2] == "cs":
            print(curve, "step", stepped(d, commanded), flush=True)
    if sys.argv[2] == "cs" and drive == "ideal":
        resting = {"torque_curve": "backlash", "drive": drive, "mode": "quasistatic"}
        print("at rest", initial(d, resting), stepped(d, resting), flush=True)
        linear = {"torque_curve": "linear", "drive": drive}
        print("a jump", stepped(d, linear, jump=1e-3), flush=True)
