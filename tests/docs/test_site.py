"""The site: built without a warning, and its tables of keys are those of schemas and pages at once."""

import dataclasses
import re
import subprocess
import sys

import pytest
from places import DOCS, ROOT
from pydantic.fields import FieldInfo

from coupling.run.usual_ranges import EXPECTED
from docs.site import generated, keys, source
from docs.site.keys import Row, case_rows, case_sections, robot_sections, rows

# Keys that choose a table: each table has its own name as their value.
CHOICES = ("kind", "model", "method")
SECTIONS = [*case_sections(), *(section for part in robot_sections() for section in part)]
_PLAIN = re.compile(r"-?\d+(?:\.\d+)?(?:e-?\d+)?|`[\w.-]+`")


def test_the_site_is_built_without_a_warning(tmp_path):
    """Pages, generated tables, links and anchors; `make site` draws them, with those of the modules."""
    pytest.importorskip("sphinx", reason="needs the extra 'docs': make site")
    command = [sys.executable, "-m", "docs.site.build", "--check", "-o", str(tmp_path)]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


def test_every_formula_of_the_pages_is_drawn():
    pytest.importorskip("sphinx", reason="needs the extra 'docs': make site")
    pytest.importorskip("latex2mathml", reason="needs the extra 'docs': make site")
    from docs.site.mathml import mathml

    formula = re.compile(r"^```math\n(.+?)^```|\$([^$\n`]+)\$", re.MULTILINE | re.DOTALL)
    for page in DOCS.glob("*.md"):
        for found in formula.finditer(page.read_text()):
            drawn = re.sub(r"<[^>]*>", "", mathml(found[1] or found[2], "inline"))
            assert "\\" not in drawn, f"{page.name}: {found[0]}"


def test_every_key_that_a_page_tells_of_is_one():
    """The other way round, a key that no page tells of, is refused where the tables are made."""
    used = {(row, key) for section in SECTIONS for key, row in section.told.items()}
    robot = [*rows("robot_file"), *rows("export")]
    told = [*case_rows(), *(row for part in robot for row in part)]
    keyed = {(row, key) for row in told for key in row.keys}
    # Words in the cell of a key that are none.
    assert {key for _, key in keyed - used} <= {"sources"}


def test_the_site_tells_every_usual_range():
    page = generated.usual_ranges_page()
    assert "| `process.poisson_ratio` | 0.1 to 0.48, or 0 | metals and plastics |" in page
    assert page.count("\n| `") == len(EXPECTED)


def test_a_key_without_a_row_is_refused():
    reader = keys._Reader("case_file", [row for row in case_rows() if "feed_m_s" not in row.keys])
    with pytest.raises(ValueError, match=r"row for the key 'feed_m_s' of \[tool_path\] cone"):
        list(reader.sections(keys.CaseFile, ""))


def stated(row: Row) -> list[str]:
    """The defaults that a page states as values, not in words."""
    cell = row.default.rpartition("default ")[2]
    return [_number(part) for part in cell.split(", ") if _PLAIN.fullmatch(part)]


def _number(text: str) -> str:
    return text.strip("`") if text.startswith("`") else f"{float(text):g}"


def checked(field: FieldInfo) -> str | None:
    """A default that is a value, as a page would have it."""
    if isinstance(field.default, bool):
        return str(field.default).lower()
    if isinstance(field.default, int | float):
        return f"{field.default:g}"
    if field.default == [1.0]:
        return "1"
    return field.default if isinstance(field.default, str) and field.default else None


def test_every_default_that_a_page_states_is_the_schemas():
    for section in SECTIONS:
        fields = section.schema.model_fields
        for row in {id(row): row for row in section.told.values()}.values():
            mine = [key for key in row.keys if key in fields and key not in CHOICES]
            expected = [value for key in mine if (value := checked(fields[key])) is not None]
            said = stated(row)
            # One word may stand for all keys of the row.
            agrees = not said or said == expected or said * len(expected) == expected
            assert agrees, f"{section.title}: {row.keys}: {said}, the schema has {expected}"


def test_the_sections_of_the_index_hold_every_page():
    listed = source.sections((DOCS / "index.md").read_text())
    assert {page for pages in listed.values() for page in pages} == {
        page.name for page in DOCS.glob("*.md")
    } - {"index.md"}
    assert {"First steps", "How to", "Reference", "Background"} <= set(listed)


def test_every_picture_is_in_the_gallery_and_every_example_says_what_it_is():
    page = generated.gallery_page()
    assert {file.name for file in DOCS.glob("figures/*")} <= set(re.findall(r"[\w-]+\.png", page))
    assert not re.search(r"^- .*\): *$", page, re.MULTILINE)


def test_links_follow_pages_and_files_to_their_places(tmp_path):
    page = ROOT / "docs" / "page.md"
    made = source.Source(tmp_path, {page: "page.md", DOCS / "fmu.md": "fmu.md"})
    made.write("deep/page.md", "[a](fmu.md#time) [b](../LICENSE) [c](https://d.example/e.md)", page)
    written = (tmp_path / "deep" / "page.md").read_text()
    assert written == "[a](../fmu.md#time) [b](../files/LICENSE) [c](https://d.example/e.md)"
    assert (tmp_path / "files" / "LICENSE").read_bytes() == (ROOT / "LICENSE").read_bytes()


def test_a_row_tells_of_the_kinds_it_names():
    row = Row("tool_path", "all but csv", ("feed_m_s",), "speed", "")
    assert row.says("tool_path", "cone", "feed_m_s")
    assert not row.says("tool_path", "csv", "feed_m_s")
    assert not dataclasses.replace(row, variants="line").says("tool_path", "cone", "feed_m_s")
