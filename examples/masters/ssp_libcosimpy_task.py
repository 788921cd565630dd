"""An SSP archive, system.ssp, in libcosim; times are in nanoseconds."""

import numpy as np
from libcosimpy.CosimExecution import CosimExecution
from libcosimpy.CosimObserver import CosimObserver

STEP, STOP = 0.01, 1.1
TCP = ["tcp.x", "tcp.y", "tcp.z", "tcp.qx", "tcp.qy", "tcp.qz", "tcp.qw"]
WRENCH = ["force.x", "force.y", "force.z", "moment.x", "moment.y", "moment.z"]

execution = CosimExecution.from_ssp_file("system.ssp", round(STEP * 1e9))
outputs = CosimObserver.create_last_value()
execution.add_observer(outputs)
robot = execution.slave_index_from_instance_name("robot")
process = execution.slave_index_from_instance_name("process")


def references(slave, names):
    known = {v.name.decode(): v.reference for v in execution.slave_variables(slave)}
    return [known[name] for name in names]


of_robot, of_process = references(robot, TCP), references(process, WRENCH)
rows = []
for k in range(round(STOP / STEP)):
    assert execution.step()
    pose = outputs.last_real_values(robot, of_robot)
    wrench = outputs.last_real_values(process, of_process)
    rows.append([(k + 1) * STEP, *pose, *wrench])
np.savetxt("tcp.csv", rows, delimiter=",", fmt="%.17g")
