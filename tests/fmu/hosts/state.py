"""Saved states go on bit for bit: state.py FMU FOLDER save|load CURVE,MODE,TRAJECTORY,SPRING,PLANE ...

Stiffnesses [N/m] of a spring at the TCP, whose anchor moves, and of a plane below the tool that lifts
off; both come and go.
"""

import sys
from pathlib import Path

import numpy as np
from fmu import Fmu, push

STEPS = [0.004, 0.004, 0.011, 0.0007, 0.02, 0.004, 0.003, 0.05]


def contact(k):
    """Spring and plane in every other four steps, their anchor rising and falling."""
    touches = stiffness * (k // 4 % 2)
    if plane:
        return {
            "anchor.x": 1.417,
            "anchor.z": 1.4146 + 2e-4 * (k % 5),
            "anchor.vz": 0.02 * (k % 3 - 1),
            "contact.stiffness": plane * (k // 4 % 2),
            "contact.dissipation": 0.5,
            "contact.friction": 0.3,
            "contact.nx": 0.1,
            "contact.nz": 2.0,
        }
    return {
        "anchor.x": 1.75,
        "anchor.z": 0.8 + 1e-3 * (k % 5),
        "anchor.vz": 0.1 * (k % 3 - 1),
        "anchor.kxx": touches,
        "anchor.kzz": 3.0 * touches,
        "anchor.kxz": touches,
    }


def shake(instance, first):
    rows = []
    for k in range(first, first + 8):
        instance.set({**push(k), **contact(k)})
        instance.step(STEPS[k % len(STEPS)])
        rows.append(instance.get())
    return np.array(rows)


def save(fmu, folder, strings):
    instance = fmu.instance().start(strings=strings)
    shake(instance, 0)
    # What the stepper knows of its last step goes along: nothing is changed before the next one.
    plain = instance.time, instance.slave.getFMUstate()
    plain_data = instance.slave.serializeFMUstate(plain[1])
    plain_expected = shake(instance, 24)
    if plane:
        touching = plain_expected[:, fmu.outputs.index("contact.fz")] > 0.0
        assert 0 < np.count_nonzero(touching) < len(touching)
    for again in (plain[1], instance.slave.deSerializeFMUstate(plain_data)):
        instance.slave.setFMUstate(again)
        instance.time = plain[0]
        np.testing.assert_array_equal(shake(instance, 24), plain_expected)
    instance.slave.setFMUstate(plain[1])
    instance.time = plain[0]
    # A tunable parameter that waits for the next step belongs to the state as well.
    instance.set({"joint[2].stiffness": 1.7e6})
    time, state = instance.time, instance.slave.getFMUState()
    data = instance.slave.serializeFMUstate(state)
    assert data == instance.slave.serializeFMUstate(state)
    expected = shake(instance, 24)

    def goes_on(other):
        other.time = time
        np.testing.assert_array_equal(shake(other, 24), expected)

    for _ in range(2):  # back, and back again
        instance.slave.setFMUState(state)
        goes_on(instance)
    # Later states do not disturb an earlier one.
    instance.slave.getFMUState()
    instance.slave.setFMUState(state)
    goes_on(instance)
    # Another instance, fresh or in the middle of something else.
    fresh, busy = fmu.instance(), fmu.instance()
    busy.start(strings={**strings, "torque_curve": "linear"})
    shake(busy, 5)
    for other in (fresh, busy):
        other.slave.setFMUState(state)
        goes_on(other)
    # A state from before initialisation ended, and fmi2Reset.
    raw = fmu.instance()
    before = raw.slave.getFMUState()
    raw.start(strings=strings)
    first = shake(raw, 0)
    raw.slave.setFMUState(before)
    raw.start(strings=strings)
    np.testing.assert_array_equal(shake(raw, 0), first)
    raw.set({"joint[1].stiffness": 5e5})
    raw.slave.reset()
    raw.start(strings=strings)
    np.testing.assert_array_equal(shake(raw, 0), first)
    raw.slave.setFMUState(raw.slave.deSerializeFMUstate(data))
    goes_on(raw)
    damping_between(raw, strings)
    folder.joinpath("state.bin").write_bytes(data)
    np.savez(folder / "expected.npz", expected=expected, time=time)


def damping_between(instance, strings):
    """A state goes on with its own damping, whatever was computed in its posture since."""
    instance.slave.reset()
    instance.start(strings=strings)
    before = instance.slave.getFMUState()

    def step():
        instance.time = 0.0
        instance.step(0.004)

    def goes_on():
        """The next step is as long as the last one inside the native stepper: 1 ms, then 3 ms."""
        instance.set(push(1))
        instance.step(0.003)
        return instance.get()

    step()
    after = instance.slave.getFMUState()
    expected = goes_on()
    instance.slave.setFMUState(before)
    instance.set({"joint[2].damping": 4e3, "joint[3].damping": 9e3})
    step()
    instance.slave.setFMUState(after)
    np.testing.assert_array_equal(goes_on(), expected)


def load(fmu, folder, strings):
    data = folder.joinpath("state.bin").read_bytes()
    with np.load(folder / "expected.npz") as archive:
        expected, time = archive["expected"], float(archive["time"])
    instance = fmu.instance()
    instance.slave.setFMUState(instance.slave.deSerializeFMUstate(data))
    instance.time = time
    np.testing.assert_array_equal(shake(instance, 24), expected)


if __name__ == "__main__":
    file, folder, what, *cases = sys.argv[1:]
    fmu = Fmu(file)
    for number, case in enumerate(cases):
        print("##", case, file=sys.stderr)
        curve, mode, trajectory, *numbers = case.split(",")
        stiffness, plane = map(float, numbers)
        strings = {"torque_curve": curve, "mode": mode, "trajectory": trajectory}
        own = Path(folder, str(number))
        own.mkdir(exist_ok=True)
        {"save": save, "load": load}[what](fmu, own, strings)
