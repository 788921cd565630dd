"""Snippets of pages run as they stand."""

from __future__ import annotations

import re

import numpy as np
from places import DOCS


def test_the_snippet_of_the_derivatives_runs():
    """And what it says of shapes holds; the compliance is symmetric."""
    page = (DOCS / "derivatives.md").read_text()
    (snippet,) = re.findall(r"```python\n(.*?)```", page, re.DOTALL)
    names: dict = {}
    exec(snippet, names)
    robot, linear = names["robot"], names["linear"]
    compliance = robot.compliance()
    np.testing.assert_allclose(
        compliance, compliance.T, rtol=0, atol=1e-6 * np.abs(compliance).max()
    )
    assert linear.dynamic_compliance(np.array([10.0, 100.0])).shape == (2, 6, 6)
