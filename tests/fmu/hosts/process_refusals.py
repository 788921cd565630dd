"""An exported process refuses a pose many times and loses no references: process_refusals.py FMU."""

import gc
import sys

import fmpy
from fmpy.fmi1 import FMICallException
from fmpy.fmi2 import FMU2Slave


def references():
    found = [o for o in gc.get_objects() if isinstance(o, type) and o.__name__ == "ProcessSlave"]
    return sum(map(sys.getrefcount, found))


if __name__ == "__main__":
    description = fmpy.read_model_description(sys.argv[1])
    process = FMU2Slave(
        guid=description.guid,
        unzipDirectory=fmpy.extract(sys.argv[1]),
        modelIdentifier="Process",
        instanceName="process",
    )
    process.instantiate()
    process.setupExperiment(startTime=0.0)
    process.enterInitializationMode()
    process.exitInitializationMode()
    before = references()
    assert before > 0
    for _ in range(50):
        try:
            process.setReal([1], [float("nan")])
        except FMICallException:
            continue
        raise AssertionError("it was taken")
    assert references() == before
    process.freeInstance()
