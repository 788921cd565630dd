"""Couple the elastic-robot FMU with a process model and compensate its deviation at a desk.

Conventions (units, frames, signs, vector orders) are those of `help(elastic_robot)`.
"""
