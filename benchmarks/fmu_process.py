"""Times a robot FMU through FMPy: python -m benchmarks.fmu_process JOB.pickle ANSWER.npz.

A process of its own, as `coupling.fmu.driver` explains; it imports nothing of `elastic_robot`, so
that the FMU's own modules answer.
"""

import os
import pickle
import sys
from pathlib import Path

import numpy as np

from benchmarks.stopwatch import timed
from coupling.fmu.driver import load
from coupling.native.desk_library import loaded_library

if __name__ == "__main__":
    folder, job = pickle.loads(Path(sys.argv[1]).read_bytes())
    driver = load(folder, loaded_library())
    spent, poses = timed(lambda: driver.run(job, lambda done, total: None))
    np.savez(sys.argv[2], spent=spent, poses=poses)
    os._exit(0)  # past the destructors of PythonFMU's binary
