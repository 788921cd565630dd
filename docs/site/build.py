"""Build the site, every warning an error: make site."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path


def main(arguments: Sequence[str] | None = None) -> int:
    """Build, and return the exit status."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("-o", "--output", type=Path, default=Path("results/site"))
    quick = "without the pages of the modules, and write nothing: links and tables"
    parser.add_argument("--check", action="store_true", help=quick)
    chosen = parser.parse_args(arguments)
    try:
        from sphinx.cmd.build import build_main
    except ImportError:
        print("error: expected Sphinx, got none: pip install -e .[docs]", file=sys.stderr)
        return 2
    from docs.site.source import write_source

    source, pages = chosen.output / "source", chosen.output / "html"
    write_source(source, python=not chosen.check)
    builder = "dummy" if chosen.check else "html"
    options = ["-W", "--keep-going", "-q", "-j", "auto", "-b", builder]
    options += ["-c", str(Path(__file__).parent)]
    status = build_main([*options, "-d", str(chosen.output / "doctrees"), str(source), str(pages)])
    if not status and not chosen.check:
        print(f"{pages / 'index.html'}: written")
    return status


if __name__ == "__main__":
    sys.exit(main())
