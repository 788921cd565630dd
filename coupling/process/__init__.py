"""Process models: every model is a table of the case file that answers `process(task)`.

A process sees the whole actual tool path and returns the whole wrench history on the tool.
"""

from coupling.process.base import Process, Task, Watchable
from coupling.process.elastic_wall import ElasticWall, ElasticWallTable
from coupling.process.isf_force_law import IsfForceLaw, IsfForceLawTable
from coupling.process.sheet import SheetFemTable

PROCESSES = {
    "elastic-wall": ElasticWallTable,
    "isf-force-law": IsfForceLawTable,
    "sheet-fem": SheetFemTable,
}

__all__ = [
    "PROCESSES",
    "ElasticWall",
    "ElasticWallTable",
    "IsfForceLaw",
    "IsfForceLawTable",
    "Process",
    "SheetFemTable",
    "Task",
    "Watchable",
]
