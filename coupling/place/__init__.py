"""Placement of the part and attitude of the tool: a stiff robot whose gears do not reverse.

Thousands of settings at once: arrays have components first and the batch, one for each setting and each
place of its path, last.
"""
