"""Many instances in one process, of two robots, answer as one alone: instances.py FMU OTHER."""

import sys

import numpy as np
from fmu import Fmu, push


def alone(fmu):
    instance = fmu.instance().start()
    path = [follow(instance, k) for k in range(8)]
    instance.free()
    return path


def follow(instance, k):
    instance.set(push(k))
    instance.step(0.005)
    return instance.get()


fmu, other = Fmu(sys.argv[1]), Fmu(sys.argv[2])
expected, of_other = alone(fmu), alone(other)
for _ in range(20):
    np.testing.assert_array_equal(alone(fmu), expected)
together = [(fmu, expected), (other, of_other)] * 5
instances = [one.instance().start() for one, _ in together]
for k in range(8):
    for instance, (_, path) in zip(instances, together, strict=True):
        np.testing.assert_array_equal(follow(instance, k), path[k])
assert not np.allclose(expected[-1][:7], of_other[-1][:7])
