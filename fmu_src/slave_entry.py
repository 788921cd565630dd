"""What PythonFMU runs to find a slave; in an FMU its name is the slave's, with `entry` for `slave`.

For every instance PythonFMU puts the resources first on the module path, imports this file by its name,
runs it again in the names of the imported module, looks for the class of a slave among what the second
run makes, and takes the module's of that name.  It keeps what the second run makes, lets go of the
module's names once too often, and leaves the module path as it is.  So the second run makes nothing,
with which the class's name is empty, takes hold of the names once more, and takes the path back.
"""

import ctypes
import importlib
import os
import sys

if "" in globals():
    ctypes.pythonapi.Py_IncRef(ctypes.py_object(globals()))
    globals()["_leave_path"]()
else:

    def _leave_path() -> None:
        """Remove the first folder that has this file: PythonFMU's."""
        for place in sys.path:
            if os.path.isfile(os.path.join(place, f"{__name__}.py")):
                sys.path.remove(place)
                return

    _slave = __name__.replace("_entry", "_slave")
    _class = "".join(word.capitalize() for word in _slave.split("_"))
    try:
        globals()[""] = globals()[_class] = getattr(importlib.import_module(_slave), _class)
    except BaseException:
        _leave_path()
        raise
