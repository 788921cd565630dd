"""Fresh processes that need not wait for imports: fresh.py MODULE..., and for each a line on stdin.

They are forked from this one, which has loaded these modules, and nothing of the project.  A line of
JSON has `command` (script and arguments), `folder`, `environment`, `stdout` and `stderr`, files; it is
answered by the exit code, below 0 that of a signal; SIGALRM ends what takes longer than PATIENCE.
"""

import importlib
import json
import os
import signal
import sys

PATIENCE = 300  # [s]


def become(order):
    """Be as a process that was started with the command."""
    signal.alarm(PATIENCE)
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


for name in sys.argv[1:]:
    importlib.import_module(name)
for line in sys.stdin:
    child = os.fork()
    if child == 0:
        become(json.loads(line))
        break
    print(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]), flush=True)
