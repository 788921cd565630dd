"""Memory stays flat over many steps: memory.py FMU STEPS."""

import resource
import sys

from fmu import POSE, Fmu, push

fmu, steps = Fmu(sys.argv[1]), int(sys.argv[2])
instance = fmu.instance().start()
forces = [push(k) for k in range(50)]


def resident():
    with open("/proc/self/statm") as statm:
        return int(statm.read().split()[1]) * resource.getpagesize()


def run(count):
    for k in range(count):
        instance.set(forces[k % 50])
        instance.step(0.004)
        instance.get(POSE)
        if k % 100 == 0:
            instance.slave.freeFMUstate(instance.slave.getFMUstate())


run(steps // 10)
before = resident()
run(steps)
grown = resident() - before
assert grown < 20 * steps, f"{grown} bytes in {steps} steps"
print(f"{grown} bytes in {steps} steps", file=sys.stderr)
