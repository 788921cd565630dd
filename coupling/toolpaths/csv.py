"""A tool path from a file."""

from __future__ import annotations

from typing import Literal

import numpy as np

from coupling.errors import CaseError
from coupling.files.csv_table import POSE_COLUMNS, read_table
from coupling.files.toml_file import FilePath
from coupling.path.frame import Frame
from coupling.path.histories import ToolPath
from coupling.toolpaths.instants import NONE, Corners, inserted
from coupling.toolpaths.table import ToolPathTable
from coupling.toolpaths.untilted import UntiltedPath

# A quaternion written with few digits is normalised; beyond this it is a mistake.
_UNIT_TOLERANCE = 1e-3


class CsvPath(ToolPathTable):
    """Poses of the TCP in the part frame, from a CSV file.

    Keys: file, with the columns time, x, y, z, qx, qy, qz, qw (s, m, unit quaternion of
    part_from_tool).  The path must begin and end at rest, because the drives do.  Where the tilt is
    measured from the path, the normal is each row's own: opposite to its axis of approach.
    """

    kind: Literal["csv"]
    file: FilePath

    def untilted(self, part: Frame, corners: Corners = NONE) -> UntiltedPath:
        """Return the tool path in the world before the tool is turned.

        Raises:
            CaseError: If the file is unreadable or not a path.
        """
        table = read_table(self.file, ("time", *POSE_COLUMNS), CaseError)
        length = np.linalg.norm(table[:, 4:], axis=1)
        wrong = np.flatnonzero(np.abs(length - 1.0) > _UNIT_TOLERANCE)
        if len(wrong):
            raise CaseError(
                f"{self.file}: expected quaternions of length 1, got length"
                f" {length[wrong[0]]:.6g} in row {wrong[0] + 1}"
            )
        try:
            path = ToolPath(table[:, 0], table[:, 1:]).transformed(part)
        except ValueError as cause:
            raise CaseError(f"{self.file}: {cause}") from cause
        return self._headed(UntiltedPath(part, *inserted(path, corners)))
