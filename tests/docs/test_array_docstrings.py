"""Docstrings of arrays state their shape and their unit."""

import ast
import re
from collections.abc import Iterator

from places import ROOT

_FOUND = (file.parent for file in (ROOT / "coupling").glob("*/__init__.py"))
PACKAGES = [ROOT / "fmu_src/elastic_robot", *_FOUND]
SHAPE = re.compile(r"\([^()]*,[^()]*\)|\(\.\.\.\)|\bshape\b")
# What has no unit, or that of what it is made of, says so in words.
UNIT = re.compile(
    r"\[[^\]]+\]|\b(units?|shares?|masks?|numbers?|ind(ex|ices)|weights?|directions?|rotations?"
    r"|quaternion|matri(x|ces))\b",
    re.IGNORECASE,
)


def _is_array(annotation: ast.expr | None) -> bool:
    text = "" if annotation is None else ast.unparse(annotation)
    return "np.ndarray" in text and "Callable" not in text


def _arrays(own: ast.FunctionDef) -> list[str]:
    """Return the names of arguments that are arrays, and "return" where the result is one."""
    found = [each.arg for each in own.args.args + own.args.kwonlyargs if _is_array(each.annotation)]
    return found + ["return"] * _is_array(own.returns)


def _is_contract(owner: ast.AST) -> bool:
    bases = owner.bases if isinstance(owner, ast.ClassDef) else []
    return any(ast.unparse(base) in ("Protocol", "ABC") for base in bases)


def _entries(doc: str) -> dict[str, str]:
    """Return the text of each attribute or argument of a docstring."""
    found: dict[str, str] = {}
    for names, text in re.findall(r"^    ([\w, ]+): ((?:.|\n {8})*)", doc, re.MULTILINE):
        found |= dict.fromkeys(names.split(", "), text)
    return found


def _described(owner: ast.Module | ast.ClassDef, contracts: set[str]) -> Iterator[tuple[str, str]]:
    """Yield the name of what has public arrays and what its docstring says of them."""
    doc, in_class = ast.get_docstring(owner) or "", isinstance(owner, ast.ClassDef)
    for own in owner.body:
        if isinstance(own, ast.AnnAssign) and in_class and _is_array(own.annotation):
            yield (name := ast.unparse(own.target)), _entries(doc).get(name, "")
        elif isinstance(own, ast.ClassDef) and not own.name.startswith("_"):
            yield from ((f"{own.name}.{name}", text) for name, text in _described(own, contracts))
        elif isinstance(own, ast.FunctionDef) and _arrays(own):
            # What implements a contract is described there; a setter by its property.
            known = in_class and not _is_contract(owner) and own.name in contracts
            if not known and not any("setter" in ast.unparse(by) for by in own.decorator_list):
                text = (ast.get_docstring(own) or "") + doc * _is_contract(owner)
                entries = _entries(text)
                yield own.name, text
                yield from ((own.name, entries[key]) for key in _arrays(own) if key in entries)


def test_public_arrays_have_shape_and_unit():
    trees = {
        file: ast.parse(file.read_text(encoding="utf-8"))
        for package in PACKAGES
        for file in sorted(package.rglob("*.py"))
    }
    owners = [own for tree in trees.values() for own in tree.body if _is_contract(own)]
    functions = [own for owner in owners for own in owner.body if isinstance(own, ast.FunctionDef)]
    contracts = {own.name for own in functions if _arrays(own)}
    lacking = [
        f"{file.relative_to(ROOT)}: {name}"
        for file, tree in trees.items()
        for name, text in _described(tree, contracts)
        if "_" not in (name[0], name.partition(".")[2][:1])
        and not (SHAPE.search(text) and UNIT.search(text))
    ]
    assert lacking == []


def test_entries_of_docstrings_are_noun_phrases():
    """ "Largest deviation [m]", not "What is left" or "Of the command"."""
    sentence = re.compile(
        r"^ +[a-z_, ]+: (?:What|Of|Where|How|Why|To|That|Whose|Which) [^=].*", re.MULTILINE
    )
    found = [
        f"{file.relative_to(ROOT)}: {line.strip()}"
        for package in PACKAGES
        if package.name not in ("elastic_robot", "inverse")
        for file in sorted(package.rglob("*.py"))
        for line in sentence.findall(file.read_text(encoding="utf-8"))
    ]
    assert found == []
