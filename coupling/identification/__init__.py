"""Identification of a robot's parameters from measurements.

Here is what all share: least squares, intervals, separability, evidence, verdicts, the robot file.  A
package for each kind of measurement: `static` deflections, loading `loops`, a `motion` of the motors,
measured `runs` of the tool; `next` finds the next command from the latter.
"""
