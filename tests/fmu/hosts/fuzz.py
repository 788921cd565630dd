"""Random calls: no crash, and a right answer after each of them: fuzz.py FMU CASES SEED.

An instance is put through random sequences of right and wrong calls.  Whatever was refused must have
changed nothing: at the end, another instance is given the calls that were taken and must give the
same answer, bit for bit.
"""

import random
import sys

import numpy as np
from fmpy.fmi1 import FMICallException
from fmu import Fmu, require_error

fmu = Fmu(sys.argv[1])
cases, rng = int(sys.argv[2]), random.Random(int(sys.argv[3]))
variables = fmu.description.modelVariables
inputs = [v.valueReference for v in variables if v.causality == "input"]
tunable = [v.valueReference for v in variables if v.variability == "tunable"]
starts = {v.valueReference: v.start for v in variables}
everything = [v.valueReference for v in variables]
reals = [v.valueReference for v in variables if v.type == "Real"]
last = max(everything)
SIZES = [0.0, 1e-6, 0.001, 0.004, 0.01, 0.02, -0.001, float("nan"), float("inf")]
VALUES = [0.0, 1.0, -20.0, 1e-300, float("nan"), float("inf"), -float("inf"), 1e308]
REFERENCES = [0, 1, 7, last - 7, last, last + 1, last + 2, 500, 2**31 - 1, 2**31, 2**32 - 1]


def random_call():
    kind = rng.choice("iiitsssgGrwWbfF")
    if kind == "i":
        vrs = rng.sample(inputs, rng.randint(1, 6))
        return "setReal", vrs, [0.01 * rng.gauss(0.0, 1.0) for _ in vrs]
    if kind == "t":
        vr = rng.choice(tunable)
        return "setReal", [vr], [float(starts[vr]) * rng.uniform(0.9, 1.1)]
    if kind == "w":
        vrs = [rng.choice(everything + REFERENCES) for _ in range(rng.randint(0, 4))]
        return "setReal", vrs, [rng.choice(VALUES) for _ in vrs]
    if kind == "W":
        name = rng.choice(["setInteger", "setBoolean"])
        return name, [rng.choice(REFERENCES)], [rng.choice([0, 1])]
    if kind == "f":
        return (
            "setString",
            [rng.choice(everything + REFERENCES)],
            [rng.choice(["", "%s%n", "x" * 999])],
        )
    if kind == "F":
        return ("state",)
    if kind == "s":
        return "step", rng.choice(SIZES)
    if kind == "b":
        return rng.choice(["getInteger", "getBoolean", "getString"]), [rng.choice(REFERENCES)]
    if kind == "r":
        return "getReal", [rng.choice(REFERENCES) for _ in range(rng.randint(0, 5))]
    return "getReal", rng.sample(reals, 5)


def apply(instance, call):
    name, *arguments = call
    if name == "step":
        instance.step(*arguments)
    elif name == "state":
        instance.slave.setFMUstate(instance.slave.getFMUstate())
    else:
        getattr(instance.slave, name)(*arguments)


def changes(call):
    return call[0] in ("setReal", "step", "setString")


refused = 0
for case in range(cases):
    setting = {"mode": rng.choice(["dynamic", "quasistatic"]), "torque_curve": "backlash"}
    instance, taken = fmu.instance().start(strings=setting), []
    for _ in range(25):
        call = random_call()
        try:
            apply(instance, call)
        except FMICallException as error:
            require_error(error)
            refused += 1
        else:
            if changes(call):
                taken.append(call)
    other = fmu.instance().start(strings=setting)
    for call in taken:
        apply(other, call)
    try:
        answer = instance.get()
    except FMICallException:
        continue  # a load that no robot carries
    assert np.all(np.isfinite(answer)), (case, answer)
    np.testing.assert_array_equal(other.get(), answer, err_msg=f"case {case}")
    instance.free()
    other.free()
print(f"{cases} cases, {refused} calls refused", file=sys.stderr)
