"""What an FMU logs of commands without rates: rates.py FMU."""

import sys

from standard import OK, WARNING, Fmu

STEP = 0.01
fmu = Fmu(sys.argv[1])


def logged(command, **options):
    """Return the warnings of an instance whose first axis is commanded q, q', q'' by step."""
    i = fmu.instance(logging=True).start(**options)
    for k in range(8):
        given = zip(("q_cmd[1]", "qd_cmd[1]", "qdd_cmd[1]"), command(k), strict=True)
        assert i.set(dict(given)) == OK
        assert i.step(k * STEP, STEP)[0] == OK
    return [text.decode() for status, category, text in i.log if status == WARNING]


(said,) = logged(lambda k: (0.001 * k, 0.0, 0.0))
assert said.startswith("q_cmd[1]"), said
assert "expected qd_cmd and qdd_cmd beside angles that change from step to step, got zero" in said
assert "name the motion's file in trajectory" in said
assert logged(lambda k: (0.001 * k, 0.1, 0.0)) == []
assert logged(lambda k: (0.001 * k, 0.0, 1.0)) == []
assert logged(lambda k: (0.1, 0.0, 0.0)) == []
assert logged(lambda k: (0.1 * (k > 3), 0.0, 0.0)) == []  # a jump that is meant
assert logged(lambda k: (0.1 * (k // 3), 0.0, 0.0)) == []
