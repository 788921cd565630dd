"""Identification from a robot in motion: its FMU is moved as the motors were."""
