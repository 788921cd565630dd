"""What PythonFMU runs to find the slave.

For every instance it imports this file by its name, runs it again in the names of the imported module,
looks for the class of a slave among what the second run makes, and takes the module's of that name.  It
never frees what it asked each class, and lets go of the module's names once too often.  So the second
run makes no class, with which the name is empty, and takes hold of the names once more.
"""

import ctypes
import sys

if "" in globals():
    ctypes.pythonapi.Py_IncRef(ctypes.py_object(globals()))
else:
    try:
        from elastic_robot_slave import ElasticRobotSlave
    except BaseException:
        if __file__.startswith(sys.path[0]):  # PythonFMU leaves it there
            del sys.path[0]
        raise
    globals()[""] = ElasticRobotSlave
