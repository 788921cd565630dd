"""The packages import as the house is drawn: contracts in pyproject.toml, read by import-linter."""

import ast
from collections import Counter
from graphlib import TopologicalSorter

import grimp
from importlinter.cli import EXIT_STATUS_SUCCESS, lint_imports
from places import ROOT


def test_imports_point_down(capfd):
    status = lint_imports(str(ROOT / "pyproject.toml"), no_cache=True)
    assert status == EXIT_STATUS_SUCCESS, capfd.readouterr().out


def test_no_module_imports_itself_through_others():
    """Module by module, the packages' own __init__ included; the sorter names a circle."""
    graph = grimp.build_graph("coupling", "elastic_robot", cache_dir=None)
    imports = {name: graph.find_modules_directly_imported_by(name) for name in graph.modules}
    assert len(list(TopologicalSorter(imports).static_order())) == len(graph.modules)


def test_public_classes_have_names_of_their_own():
    """A name that is read in a message or a page leads to one class of `coupling`."""
    trees = [
        ast.parse(file.read_text(encoding="utf-8")) for file in (ROOT / "coupling").rglob("*.py")
    ]
    classes = [own for tree in trees for own in tree.body if isinstance(own, ast.ClassDef)]
    names = Counter(own.name for own in classes if not own.name.startswith("_"))
    assert [name for name, count in names.items() if count > 1] == []
