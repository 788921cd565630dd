"""An elastic wall as an FMI 2 slave: PythonFMU packs this file."""

import os
import signal
import subprocess
import sys
import time

from pythonfmu import Fmi2Causality, Fmi2Slave, Fmi2Variability, Real


class WallSlave(Fmi2Slave):
    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.stiffness, self.height, self.force, self.dies_at = 0.0, 0.0, 0.0, 1e9
        self.hangs_at, self.killed_at = 1e9, 1e9
        parameter = {"causality": Fmi2Causality.parameter, "variability": Fmi2Variability.tunable}
        self.register_variable(Real("stiffness", **parameter))
        self.register_variable(Real("dies_at", **parameter))
        self.register_variable(Real("hangs_at", **parameter))
        self.register_variable(Real("killed_at", **parameter))
        self.register_variable(Real("height", causality=Fmi2Causality.input))
        self.register_variable(Real("force", causality=Fmi2Causality.output))

    def exit_initialization_mode(self):
        self._answer()

    def do_step(self, current_time, step_size):
        if current_time > self.dies_at:
            os._exit(3)
        if current_time > self.killed_at:
            os.kill(os.getpid(), signal.SIGKILL)
        if current_time > self.hangs_at:
            sleep = [sys.executable, "-S", "-c", "import time; time.sleep(600.0)"]
            child = subprocess.Popen(sleep, start_new_session=True)
            with open(os.environ["HANGING"], "w") as numbers:
                print(os.getpid(), child.pid, file=numbers)
            while True:
                time.sleep(1.0)
        if self.height < -1.0:
            raise ValueError("the wall is only a metre thick")
        self._answer()
        return True

    def _answer(self):
        self.force = self.stiffness * max(-self.height, 0.0)
