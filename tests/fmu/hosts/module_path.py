"""The module path after many instances, and the names of the FMU's entry: module_path.py FMU ENTRY."""

import sys

from fmu import Fmu

fmu, before = Fmu(sys.argv[1]), list(sys.path)
for _ in range(5):
    instance = fmu.instance().start()
    instance.slave.reset()
    instance.start()
    instance.free()
assert sys.path == before, sys.path
names = sys.getrefcount(sys.modules[sys.argv[2]].__dict__)
for _ in range(5):
    fmu.instance().free()
assert sys.getrefcount(sys.modules[sys.argv[2]].__dict__) == names
