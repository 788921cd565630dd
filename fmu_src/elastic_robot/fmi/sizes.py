"""Usual sizes of the FMU's variables, for solvers and plots that scale by them, in SI units."""

FORCE, MOMENT, TORQUE, SPRING = 1e3, 1e2, 1e3, 1e6
RADIUS, SLIP_SPEED = 1e-2, 1e-3
DEVIATION, ANGLE, COMPLIANCE = 1e-3, 1e-3, 1e-6
ELONGATION, PRESLIDING = 1e-4, 1e-5
RATE, ACCELERATION, GROWTH = 5e-2, 5.0, 1e5
