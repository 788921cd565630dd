"""Write the tables of docs/measured_sheet.md anew: make measured-sheet, about ten minutes.

With names, only those parts: python docs/scripts/make_measured_sheet.py law.
"""

from __future__ import annotations

import sys

from docs.scripts import measured_sheet_studies
from docs.scripts.page import finish, replace_parts

PARTS = {
    "law": measured_sheet_studies.law_table,
    "force": measured_sheet_studies.force_table,
    "shape": measured_sheet_studies.shape_table,
}


if __name__ == "__main__":
    sys.exit(finish(lambda: replace_parts("measured_sheet", PARTS, sys.argv[1:])))
