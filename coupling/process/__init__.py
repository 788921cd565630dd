"""Process models: every model is a table of the case file that answers `process(task)`.

A process sees the whole actual tool path and returns the whole wrench history on the tool.
"""

from coupling.process.base import Process, Task, Watchable
from coupling.process.elastic_wall import ElasticWall, ElasticWallTable
from coupling.process.external import External, ExternalTable
from coupling.process.isf_force_law import IsfForceLaw, IsfForceLawTable
from coupling.process.measured import Measured, MeasuredTable
from coupling.process.milling_force import MillingForceTable
from coupling.process.process_fmu import ProcessFmu, ProcessFmuTable
from coupling.process.sheet_fem_table import SheetFemTable

PROCESSES = {
    "elastic-wall": ElasticWallTable,
    "external": ExternalTable,
    "fmu": ProcessFmuTable,
    "isf-force-law": IsfForceLawTable,
    "measured": MeasuredTable,
    "milling-force": MillingForceTable,
    "sheet-fem": SheetFemTable,
}

__all__ = [
    "PROCESSES",
    "ElasticWall",
    "ElasticWallTable",
    "External",
    "ExternalTable",
    "IsfForceLaw",
    "IsfForceLawTable",
    "Measured",
    "MeasuredTable",
    "MillingForceTable",
    "Process",
    "ProcessFmu",
    "ProcessFmuTable",
    "SheetFemTable",
    "Task",
    "Watchable",
]
