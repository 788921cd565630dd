"""What a module imports."""

import ast
import doctest


def imported_packages(source: str) -> set[str]:
    """Return the packages that a source and the examples in its docstrings import, at any place."""
    names = set()
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            names |= {alias.name.split(".")[0] for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, node.module
            names.add(node.module.split(".")[0])
        elif isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef):
            examples = doctest.DocTestParser().get_examples(ast.get_docstring(node) or "")
            names = names.union(*(imported_packages(example.source) for example in examples))
    return names
