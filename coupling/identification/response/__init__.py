"""Identification from frequency responses at the tool: stiffness and damping of gears and tilts."""
