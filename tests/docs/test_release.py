"""What a release is made of says the same everywhere: version, requirements, commands, files."""

import hashlib
import json
import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest
import release
from places import ROOT

import elastic_robot

yaml = pytest.importorskip("yaml", reason="needs PyYAML, which the tests' packages bring")
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
# Pinocchio's name on conda-forge, where Windows has it too.
CONDA = {"pin": "pinocchio"}


@pytest.fixture(scope="module")
def recipe():
    return yaml.safe_load((ROOT / "recipe" / "recipe.yaml").read_text())


def test_the_recipe_requires_what_the_project_requires(recipe):
    required = {f"python {PROJECT['requires-python']}"}
    for line in PROJECT["dependencies"]:
        name, bound = re.fullmatch(r"([\w-]+)([^;]*)(?:;.*)?", line).groups()
        required.add(f"{CONDA.get(name, name)} {bound}")
    python = recipe["context"]["python_min"]
    run = [line.replace("${{ python_min }}", python) for line in recipe["requirements"]["run"]]
    assert set(run) == required


def test_the_recipe_has_the_projects_commands(recipe):
    commands = {f"{name} = {function}" for name, function in PROJECT["scripts"].items()}
    assert set(recipe["build"]["python"]["entry_points"]) == commands


# What is damaged in the recipe, and what the message must say.
DAMAGED = {
    "licence_file:": ("license_file:", "unknown field 'licence_file'"),
    "license: Mitt": ("license: MIT", "SPDX"),
    "numpy >>1.26": ("numpy >=1.26", "version spec: >>1.26"),
    "${{ versoin }}": ("${{ version }}", "undefined"),
    "checks:": ("tests:", "unknown top-level field 'checks'"),
}


@pytest.mark.parametrize("damage", [None, *DAMAGED])
def test_the_recipe_is_rendered_for_every_platform_and_a_damaged_one_refused(damage):
    pytest.importorskip("rattler_build", reason="needs py-rattler-build, as the lock has it")
    text = (ROOT / "recipe" / "recipe.yaml").read_text()
    if damage is None:
        release.check_recipe(text)
        return
    whole, words = DAMAGED[damage]
    assert whole in text
    with pytest.raises(release.ReleaseError, match=re.escape(words)):
        release.check_recipe(text.replace(whole, damage))


def test_every_file_says_the_version_and_the_words_of_the_project(recipe):
    meta = json.loads((ROOT / "codemeta.json").read_text())
    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text())
    assert recipe["context"]["version"] == meta["version"] == elastic_robot.__version__
    assert citation["version"] == elastic_robot.__version__
    assert meta["description"] == recipe["about"]["summary"] == PROJECT["description"]
    assert set(citation["keywords"]) == set(meta["keywords"]) == set(PROJECT["keywords"])


def test_the_container_is_made_of_what_is_there():
    text = (ROOT / "Containerfile").read_text()
    copied = [
        name
        for line in re.findall(r"^COPY (?!--from)(.+) \S+$", text, re.MULTILINE)
        for name in line.split()
    ]
    assert copied
    assert [name for name in copied if not (ROOT / name).exists()] == []
    assert re.findall(r"\[(\w+)\]\"", text) == ["fem"]
    assert "fem" in PROJECT["optional-dependencies"]
    (command,) = json.loads(re.search(r"^ENTRYPOINT (.+)$", text, re.MULTILINE)[1])
    assert command in PROJECT["scripts"]


def test_a_version_without_changes_is_refused():
    with pytest.raises(release.ReleaseError, match=r"'## \[9\.9\] - DATE', got none"):
        release.changes("9.9", (ROOT / "CHANGELOG.md").read_text())
    assert release.changes(elastic_robot.__version__, (ROOT / "CHANGELOG.md").read_text())


def test_checksums_are_those_of_sha256sum(tmp_path):
    (tmp_path / "a.whl").write_bytes(b"abc")
    assert (
        release.checksums([tmp_path / "a.whl"]) == f"{hashlib.sha256(b'abc').hexdigest()}  a.whl\n"
    )
    (tmp_path / "SHA256SUMS").write_text(release.checksums([tmp_path / "a.whl"]))
    command = ["sha256sum", "--check", "SHA256SUMS"]
    assert subprocess.run(command, cwd=tmp_path, capture_output=True).returncode == 0


def test_an_sdist_that_makes_another_wheel_is_refused(tmp_path):
    """A project of one file, which is another one in its second sdist."""
    project = tmp_path / "one-1.0"
    project.mkdir()
    keys = '[build-system]\nrequires = ["hatchling"]\nbuild-backend = "hatchling.build"\n'
    (project / "pyproject.toml").write_text(f'{keys}[project]\nname = "one"\nversion = "1.0"\n')

    def built(target: str, value: int) -> Path:
        folder = tmp_path / f"{target}{value}"
        (project / "one.py").write_text(f"x = {value}\n")
        command = [sys.executable, "-m", "hatchling", "build", "-t", target, "-d", str(folder)]
        subprocess.run(command, cwd=project, check=True, capture_output=True)
        return next(folder.iterdir())

    wheel = built("wheel", 1)
    for value in (1, 2):
        (tmp_path / f"again{value}").mkdir()
    release.check_wheel_of(built("sdist", 1), wheel, tmp_path / "again1")
    with pytest.raises(
        release.ReleaseError, match=r"makes another wheel: one-1.0.*RECORD, one\.py"
    ):
        release.check_wheel_of(built("sdist", 2), wheel, tmp_path / "again2")


def test_an_archive_without_a_library_is_refused(tmp_path):
    with pytest.raises(release.ReleaseError, match=r"w\.whl: expected b, got none"):
        release._all_in({"a", "b"}, {"a"}, tmp_path / "w.whl")
