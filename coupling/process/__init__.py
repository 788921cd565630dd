"""Process models: every model is a table of the case file that answers `process(task)`.

A process sees the whole actual tool path and answers with the whole wrench history on the tools.
"""

from coupling.process.base import (
    NoisySchema,
    Process,
    ProcessResponse,
    ProcessSchema,
    ProcessTable,
    WithIdentity,
)
from coupling.process.elastic_wall import ElasticWall, ElasticWallTable
from coupling.process.external import ExternalProgram, ExternalTable
from coupling.process.external_fmu import ProcessFmu, ProcessFmuTable
from coupling.process.isf_force_law import IsfForceLaw, IsfForceLawTable
from coupling.process.measured import MeasuredWrench, MeasuredWrenchTable
from coupling.process.milling_table import MillingForceTable
from coupling.process.sheet_fem_table import SheetFemTable

PROCESSES: dict[str, type[ProcessSchema]] = {
    "elastic-wall": ElasticWallTable,
    "external": ExternalTable,
    "fmu": ProcessFmuTable,
    "isf-force-law": IsfForceLawTable,
    "measured": MeasuredWrenchTable,
    "milling-force": MillingForceTable,
    "sheet-fem": SheetFemTable,
}

__all__ = [
    "PROCESSES",
    "ElasticWall",
    "ElasticWallTable",
    "ExternalProgram",
    "ExternalTable",
    "IsfForceLaw",
    "IsfForceLawTable",
    "MeasuredWrench",
    "MeasuredWrenchTable",
    "MillingForceTable",
    "NoisySchema",
    "Process",
    "ProcessFmu",
    "ProcessFmuTable",
    "ProcessResponse",
    "ProcessSchema",
    "ProcessTable",
    "SheetFemTable",
    "WithIdentity",
]
