"""Identification of a robot's parameters from measurements: verdict and robot file are shared.

A package for each kind of measurement: `static` deflections, loading `loops`, a `motion` of the motors,
measured `runs` of the tool; `next` finds the next command from the latter.
"""
