"""Elasticity and hysteresis of gears from loading loops: docs/identify.md."""
