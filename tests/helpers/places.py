"""Where the tests find what is not Python."""

from pathlib import Path

TESTS = Path(__file__).parents[1]
ROOT = TESTS.parent
EXAMPLES, CASES, DOCS = ROOT / "examples", ROOT / "examples" / "cases", ROOT / "docs"
REFERENCE = TESTS / "reference"
HOSTS, HELPERS = TESTS / "fmu" / "hosts", TESTS / "helpers"
LINE_CASE = TESTS / "cases" / "line.toml"
