"""Tool paths: every kind is a table of the case file that answers `task(part)`."""

from coupling.toolpaths.apt import AptPath
from coupling.toolpaths.contours import Cone, Iso9283, Line, Pyramid
from coupling.toolpaths.csv import CsvPath
from coupling.toolpaths.gcode import GcodePath
from coupling.toolpaths.robot_program import ProgramPath
from coupling.toolpaths.table import ToolPathTable
from coupling.toolpaths.task import Task

TOOL_PATHS: dict[str, type[ToolPathTable]] = {
    "cone": Cone,
    "pyramid": Pyramid,
    "line": Line,
    "iso9283": Iso9283,
    "csv": CsvPath,
    "gcode": GcodePath,
    "program": ProgramPath,
    "apt": AptPath,
}

__all__ = [
    "TOOL_PATHS",
    "AptPath",
    "Cone",
    "CsvPath",
    "GcodePath",
    "Iso9283",
    "Line",
    "ProgramPath",
    "Pyramid",
    "Task",
    "ToolPathTable",
]
