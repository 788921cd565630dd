"""robot.toml -> ElasticRobot.fmu: python build_fmu.py is `elastic-robot build`."""

from __future__ import annotations

import sys
from collections.abc import Sequence

from coupling import cli


def main(arguments: Sequence[str] | None = None) -> int:
    """Build from the command line; return the exit status: 0 built, 2 bad input."""
    try:
        cli.main(["build", *(sys.argv[1:] if arguments is None else arguments)])
    except SystemExit as end:
        return int(end.code or 0)
    return 0


if __name__ == "__main__":
    sys.exit(main())
