"""The key of a process's answers: equal for what answers alike, another for every change."""

from dataclasses import replace

import numpy as np
import pytest
from places import EXAMPLES
from scipy.spatial.transform import Rotation

from coupling.case.file import load_case
from coupling.errors import CaseError
from coupling.path.frame import Frame
from coupling.process import ElasticWallTable, ExternalTable, MeasuredWrenchTable
from coupling.process.authors_code import find_process
from coupling.toolpaths import Line, Task

PART = Frame(np.array([1.0, 0.2, 0.5]), Rotation.from_euler("x", 0.3))
LINE = Line(kind="line", points_m=[[0.0, 0.0, 0.0], [0.1, 0.0, 0.0]], feed_m_s=0.1)


def task(part: Frame = PART) -> Task:
    return LINE.task(part)


def wall(**changes: float) -> ElasticWallTable:
    return ElasticWallTable(model="elastic-wall", **({"stiffness_N_m": 1e5} | changes))


def test_the_same_case_has_the_same_identity_wherever_its_results_go(tmp_path):
    file = EXAMPLES / "cases" / "cone.toml"
    one, two = load_case(file).process, load_case(file, tmp_path).process
    assert one.identity == two.identity != ""


def test_every_change_of_table_part_and_path_is_another_identity():
    moved = Frame(PART.position + np.array([0.0, 0.0, 1e-9]), PART.rotation)
    turned = Frame(PART.position, Rotation.from_euler("x", 0.3 + 1e-9))
    slower = replace(task(), forming=LINE.model_copy(update={"feed_m_s": 0.09}).path(PART))
    found = [
        wall().process(task()),
        wall(stiffness_N_m=100000.00000000001).process(task()),
        wall().process(task(moved)),
        wall().process(task(turned)),
        wall().process(slower),
    ]
    assert len({process.identity for process in found}) == len(found)


def test_a_changed_record_is_another_identity(tmp_path):
    record = tmp_path / "record.csv"
    found = set()
    for force in (1.0, 2.0):
        record.write_text(f"time,fx,fy,fz\n0,0,0,0\n99,0,0,{force}\n")
        found.add(MeasuredWrenchTable(model="measured", file=record).process(task()).identity)
    assert len(found) == 2


def test_a_changed_program_is_another_identity(tmp_path):
    program = tmp_path / "program.py"
    found = set()
    for text in ("print(1)", "print(2)"):
        program.write_text(text)
        table = {"model": "external", "command": ["{python}", str(program)], "time_limit_s": 1.0}
        found.add(ExternalTable.model_validate(table).process(task()).identity)
    assert len(found) == 2


def test_changed_code_of_ones_own_is_another_identity(tmp_path):
    code = (
        "from coupling.process import ElasticWall, ProcessTable\n"
        "class Table(ProcessTable):\n"
        "    def process(self, task):\n"
        "        return ElasticWall(None, None, 1.0, identity=self.identity(task))\n"
    )
    found = set()
    for text in (code, code + "# another"):
        (tmp_path / "own.py").write_text(text)
        model, table = find_process("own.py:Table", tmp_path)
        found.add(table(model=model).process(task()).identity)
    assert len(found) == 2


def test_a_file_that_cannot_be_read_is_named(tmp_path):
    table = MeasuredWrenchTable(model="measured", file=tmp_path / "none.csv")
    with pytest.raises(CaseError, match=r"none\.csv: cannot be read"):
        table.identity(task())
