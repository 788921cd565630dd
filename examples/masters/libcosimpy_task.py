"""The task by the Open Simulation Platform's master; times are in nanoseconds."""

import numpy as np
from libcosimpy.CosimExecution import CosimExecution
from libcosimpy.CosimManipulator import CosimManipulator
from libcosimpy.CosimObserver import CosimObserver
from libcosimpy.CosimSlave import CosimLocalSlave

STEP = 1 / 128
TCP = ["tcp.x", "tcp.y", "tcp.z", "tcp.qx", "tcp.qy", "tcp.qz", "tcp.qw"]

execution = CosimExecution.from_step_size(int(STEP * 1e9))
robot = execution.add_local_slave(CosimLocalSlave("ElasticRobot.fmu", "robot"))
reference = {v.name.decode(): v.reference for v in execution.slave_variables(robot)}
execution.string_initial_value(robot, reference["trajectory"], "motion.csv")
inputs, outputs = CosimManipulator.create_override(), CosimObserver.create_last_value()
execution.add_manipulator(inputs)
execution.add_observer(outputs)

rows = []
for k in range(128):
    inputs.slave_real_values(robot, [reference["force.z"]], [-1000.0 * k * STEP])
    assert execution.step()
    pose = outputs.last_real_values(robot, [reference[name] for name in TCP])
    rows.append([(k + 1) * STEP, *pose])
np.savetxt("tcp.csv", rows, delimiter=",", fmt="%.17g")
