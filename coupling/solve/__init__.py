"""The weak coupling, and methods of compensation: tables of the case file that answer `correct`."""

from coupling.files.toml_file import Schema
from coupling.solve.inverse import InverseCorrection
from coupling.solve.mirror import Mirror

METHODS: dict[str, type[Schema]] = {"inverse": InverseCorrection, "mirror": Mirror}

__all__ = ["METHODS", "InverseCorrection", "Mirror"]
