"""Fixtures of tests of stability."""

from __future__ import annotations

import pytest


@pytest.fixture
def coarse_charts(monkeypatch):
    for name, value in (
        ("analysis.PLACES", 6),
        ("chart._SPEEDS", 8),
        ("chart._DIRECTIONS", 4),
        ("chart._GRID", 2),
    ):
        monkeypatch.setattr(f"coupling.stability.{name}", value)
