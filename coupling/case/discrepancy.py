"""Table of the case file for what a measured robot does beyond its model: [discrepancy]."""

from __future__ import annotations

from coupling.errors import CaseError
from coupling.files.toml_file import FilePath, Schema
from coupling.path.discrepancy import Discrepancy
from coupling.path.histories import ToolPath


class DiscrepancyTable(Schema):
    """[discrepancy]: file, a table that elastic-robot next writes."""

    file: FilePath

    def along(self, desired: ToolPath) -> Discrepancy:
        """Return the discrepancy of a path, which has to be the one that was measured.

        Raises:
            CaseError: If the file cannot be read, or was measured along another path.
        """
        found = Discrepancy.read(self.file)
        try:
            found.require_along(desired)
        except CaseError as cause:
            raise CaseError(f"{self.file}: {cause}") from cause
        return found
