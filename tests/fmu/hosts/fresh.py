"""Fresh processes that need not wait for imports: fresh.py, and for each a line of JSON on stdin.

They are forked from this one, which has loaded what FMPy and an FMU need, and nothing of the project.
A line has `command` (script and arguments), `folder`, `environment`, `stdout` and `stderr`, files; it
is answered by the exit code, below 0 that of a signal.
"""

import json
import os
import sys

import fmpy.fmi2  # noqa: F401
import pinocchio  # noqa: F401
import scipy.integrate
import scipy.interpolate
import scipy.spatial.transform  # noqa: F401


def become(order):
    """Be as a process that was started with the command."""
    os.chdir(order["folder"])
    os.environ.clear()
    os.environ.update(order["environment"])
    nothing = os.open(os.devnull, os.O_RDWR)
    said = (os.open(order[name], os.O_WRONLY | os.O_CREAT) for name in ("stdout", "stderr"))
    for own, other in enumerate((nothing, *said)):
        os.dup2(other, own)
    sys.argv = order["command"]
    sys.path[0] = os.path.dirname(sys.argv[0])
    with open(sys.argv[0], encoding="utf-8") as script:
        exec(compile(script.read(), sys.argv[0], "exec"), globals())


for line in sys.stdin:
    child = os.fork()
    if child == 0:
        become(json.loads(line))
        break
    print(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]), flush=True)
