"""The cut along the path: chips, removal, torque and power beside the spindle's."""

from __future__ import annotations

import numpy as np
import plotly.graph_objects as go

from coupling.report.colours import AFTER, BEFORE
from coupling.report.lengths import three_digits
from coupling.report.style import DrawnLine, over_time
from coupling.results.cut_result import COURSES, CutResult
from coupling.results.section import Note, Section, Table

# Figures that are drawn, each in its own picture.
_DRAWN = (("depth_m", "width_m"), ("mean_chip_m", "peak_chip_m"), ("power_W",))
_NOTE = Note(
    "Along the desired path. Depth and width are those of the material in front of the cutter; chips"
    " are as thick as the feed per tooth times the sine of their angle; torque and power are means over"
    " a turn, without idle power."
)


def cut_section(cut: CutResult | None) -> list[Section]:
    """Return the section of a cut; none where nothing is milled."""
    if cut is None:
        return []
    rows = []
    for key, (title, unit, scale) in COURSES.items():
        figure = cut.figures[key]
        limit = cut.limits.get(key)
        words = [
            f"{title} [{unit}]",
            three_digits(scale * figure.mean),
            three_digits(scale * figure.largest),
            f"{figure.time_s:.2f}",
        ]
        if cut.limits:
            words.append("" if limit is None else three_digits(scale * limit))
        rows.append(words)
    sentence = (
        f"{cut.rpm:.0f} 1/min, cutting speed {60.0 * cut.cutting_speed_m_s:.0f} m/min;"
        f" {1e6 * cut.volume_m3:.3g} cm3 in {cut.cutting_time_s:.1f} s of cutting."
    )
    columns = ["cut", "mean", "largest", "at t = [s]"]
    table = Table([*columns, *(["limit of the spindle"] if cut.limits else [])], rows)
    pictures = [_picture(cut, keys) for keys in _DRAWN]
    return [Section("Cut", [sentence, table, _NOTE], "cut_course", pictures)]


def _picture(cut: CutResult, keys: tuple[str, ...]) -> go.Figure:
    _, unit, scale = COURSES[keys[0]]
    lines = [
        DrawnLine(COURSES[key][0], color, cut.time_s, scale * np.array(cut.course[key]))
        for key, color in zip(keys, (BEFORE, AFTER), strict=False)
    ]
    titles = " and ".join(COURSES[key][0] for key in keys)
    return over_time(lines, f"{titles} [{unit}]", 260)
