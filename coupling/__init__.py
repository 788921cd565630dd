"""Couple the elastic-robot FMU with a process model and compensate its deviation at a desk.

Imported as `elastic_robot.coupling` in an installed package and in a checkout, whose own modules import
it by the name of its folder, `coupling`.
Conventions (units, frames, signs, vector orders) are those of `help(elastic_robot)`.
"""
