"""README, CONTRIBUTING and docs/*.md: every link, command, file and module that they name is there."""

import importlib
import re
import subprocess
from pathlib import Path

import pytest
from places import DOCS, ROOT

import elastic_robot

PAGES = sorted([*ROOT.glob("*.md"), *DOCS.glob("*.md")])
OURS = ("benchmarks", "coupling", "docs", "examples", "fmu_src", "tests")
SOURCES = sorted(
    file
    for suffix in ("py", "c", "h", "toml", "in")
    for folder in OURS
    for file in ROOT.glob(f"{folder}/**/*.{suffix}")
)
_FENCE = re.compile(r"^ *```.*?^ *```$", re.MULTILINE | re.DOTALL)
_CODE = re.compile(r"^ *```.*?^ *```$|^(?: {4}|\t).*$|`[^`\n]+`", re.MULTILINE | re.DOTALL)
_LINK = re.compile(r"\]\((?P<file>[^)\s#]*)#?(?P<anchor>[^)\s]*)\)")
_FILE = re.compile(rf"(?<![\w/.<-])(?:{'|'.join(OURS)})/[\w./-]*\w")
_NAME = re.compile(r"(?<![\w/.-])(?:coupling|elastic_robot|benchmarks)(?:\.[A-Za-z_]\w*)+")

each_page = pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))


def anchors(page: Path) -> set[str]:
    """The anchors that GitHub gives a page's headings."""
    found: set[str] = set()
    for heading in re.findall(r"^#+ +(.+?) *$", _FENCE.sub("", page.read_text()), re.MULTILINE):
        anchor = re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-")
        repeated = sum(1 for other in found if re.fullmatch(rf"{anchor}(-\d+)?", other))
        found.add(f"{anchor}-{repeated}" if repeated else anchor)
    return found


def is_there(name: str) -> bool:
    """Whether a dotted name is a module, or something within one."""
    module, *parts = name.split(".")
    found = importlib.import_module(module)
    for part in parts:
        module = f"{module}.{part}"
        if not hasattr(found, part):
            try:
                importlib.import_module(module)
            except (
                ModuleNotFoundError
            ) as error:  # of an optional package: the module itself is there
                return error.name is not None and not module.startswith(error.name)
        found = getattr(found, part)
    return True


@each_page
def test_every_link_leads_somewhere(page):
    lost = []
    for link in _LINK.finditer(_FENCE.sub("", page.read_text())):
        if link["file"].startswith(("http:", "https:", "mailto:")):
            continue
        target = (page.parent / link["file"]).resolve() if link["file"] else page
        if not target.exists() or (link["anchor"] and link["anchor"] not in anchors(target)):
            lost.append(link[0])
    assert lost == []


@each_page
def test_every_make_command_is_one(page):
    code = "\n".join(_CODE.findall(page.read_text()))
    for target in sorted(set(re.findall(r"\bmake ([a-z][\w.-]*)", code))):
        done = subprocess.run(
            ["make", "--dry-run", target], cwd=ROOT, capture_output=True, text=True
        )
        assert done.returncode == 0, done.stderr


@each_page
def test_every_file_named_is_there(page):
    named = set(_FILE.findall(page.read_text()))
    assert [name for name in sorted(named) if not (ROOT / name).exists()] == []


@each_page
def test_every_c_file_named_is_there(page):
    known = {file.name for file in SOURCES}
    named = set(re.findall(r"`(\w+\.[ch])`", page.read_text()))
    assert sorted(named - known) == []


@each_page
def test_every_name_of_python_is_there(page):
    named = set(_NAME.findall(page.read_text()))
    assert [name for name in sorted(named) if not is_there(name)] == []


def test_every_file_named_in_the_sources_is_there():
    lost = [
        f"{file.relative_to(ROOT)}: {name}"
        for file in SOURCES
        for name in sorted(set(_FILE.findall(file.read_text(encoding="utf-8"))))
        if Path(name).suffix and not (ROOT / name).exists()
    ]
    assert lost == []


def test_citation_and_changelog_know_the_version():
    version = elastic_robot.__version__
    assert f"\nversion: {version}\n" in (ROOT / "CITATION.cff").read_text()
    assert f"\n## [{version}] - " in (ROOT / "CHANGELOG.md").read_text()


def test_the_index_lists_every_page():
    listed = set(re.findall(r"\]\((\w+\.md)\)", (DOCS / "index.md").read_text()))
    assert listed == {page.name for page in DOCS.glob("*.md")} - {"index.md"}


@pytest.mark.parametrize(
    "template", sorted(DOCS.glob("scripts/*.md.in")), ids=lambda file: file.stem
)
def test_a_written_page_is_its_template_filled(template):
    parts = re.split(r"\{[^{}]*\}", template.read_text())
    pattern = ".*?".join(re.escape(part) for part in parts)
    assert re.fullmatch(pattern, (DOCS / template.stem).read_text(), re.DOTALL)
