"""What the model needs, in a checkout and in the FMU."""

import subprocess
import sys
import zipfile
from pathlib import Path

import pytest
from imports import imported_packages

import elastic_robot
from coupling.fmu_export.build import BuildOptions, build_fmu
from elastic_robot.fingerprint import model_files

PACKAGE = Path(elastic_robot.__file__).parent
FILES = [file for file in model_files(PACKAGE) if file.suffix == ".py"]
NEEDED = {*sys.stdlib_module_names, "elastic_robot", "numpy", "scipy", "pinocchio"}


@pytest.mark.parametrize("file", FILES, ids=lambda file: file.relative_to(PACKAGE).as_posix())
def test_the_model_imports_numpy_scipy_pinocchio_and_python_alone(file):
    assert imported_packages(file.read_text(encoding="utf-8")) <= NEEDED


def test_every_module_in_the_fmu_is_imported_by_its_slave(example, tmp_path):
    """From the FMU's own folder; nothing else of the project is there to be imported."""
    with zipfile.ZipFile(build_fmu(example, tmp_path / "R.fmu", BuildOptions("python"))) as archive:
        archive.extractall(tmp_path / "fmu")
    resources = tmp_path / "fmu" / "resources"
    script = """
import sys
from pathlib import Path
sys.path.insert(0, sys.argv[1])
import elastic_robot_slave
modules = [getattr(module, "__file__", None) for module in list(sys.modules.values())]
print(*sorted(Path(file).resolve() for file in modules if file), sep="\\n")
"""
    done = subprocess.run(
        [sys.executable, "-P", "-c", script, str(resources)], capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    loaded = {Path(line) for line in done.stdout.splitlines()}
    packed = {file.resolve() for file in (resources / "elastic_robot").rglob("*.py")}
    assert packed
    assert packed <= loaded
    assert not loaded & {file.resolve() for file in FILES}
