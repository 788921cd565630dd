"""Tool paths: every kind is a table of the case file that answers `path(base_from_part)`."""

from coupling.toolpaths.contours import Cone, Pyramid
from coupling.toolpaths.csv import CsvPath
from coupling.toolpaths.line import Line

TOOL_PATHS = {"cone": Cone, "pyramid": Pyramid, "line": Line, "csv": CsvPath}

__all__ = ["TOOL_PATHS", "Cone", "CsvPath", "Line", "Pyramid"]
