"""A short line along an elastic wall, by the default scheme and method, for any robot."""

WALL_CASE = """
[robot]
description = "{robot}"
home_deg    = {home}

[part]
position_m = {part}

[tool_path]
kind     = "line"
points_m = [[0.0, 0.0, 0.0], [0.02, 0.01, -0.002]]
feed_m_s = 0.1
blend_s  = 0.1

[process]
model         = "elastic-wall"
stiffness_N_m = 2.0e5
"""
