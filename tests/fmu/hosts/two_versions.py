"""FMUs of two versions in one process; the second is refused, the first goes on: FMU OTHER."""

import sys
from contextlib import redirect_stdout

from fmu import Fmu

first = Fmu(sys.argv[1]).instance()
try:
    with redirect_stdout(sys.stderr):  # where FMPy shows messages
        Fmu(sys.argv[2]).instance()
except Exception as error:
    if "Failed to instantiate" not in str(error):
        raise
else:
    raise AssertionError("it was taken")
first.start().step(0.01)
