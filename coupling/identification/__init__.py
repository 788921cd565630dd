"""Identification of a robot's parameters from measurements.

A package for each kind of measurement: `static` deflections, singly or along loading loops, a `motion`
of the motors, frequency `response`s, `cutting` forces, measured `runs` of the tool; `next` finds the
next command from the latter.  In each a problem holds what was measured, its `Experiment` residual and
Jacobian around values of the parameters; `estimate` fits it.  What that says of a robot is an
`Identification`: figures as they are stored, and the robot as it is written.
"""
