"""Cases with changes of their text, and the small one on the moving robot, by method inverse."""

from pathlib import Path

from places import LINE_CASE

from coupling.case.case import Case
from coupling.case.file import load_case


def changed_text(case: Path, *changes: tuple[str, str]) -> str:
    """Return a case's text with changes of what stands in it once or first."""
    text = case.read_text()
    for old, new in changes:
        assert old in text, old
        text = text.replace(old, new, 1)
    return text


def moving_line(*changes: tuple[str, str]) -> str:
    """Return the case's text with changes."""
    moving = (
        ('"linear"', '"backlash"'),
        ('"quasistatic"', '"dynamic"'),
        ('method      = "mirror"\ntolerance_m = 1e-6', 'method = "inverse"'),
    )
    return changed_text(LINE_CASE, *moving, *changes)


def line_case(folder: Path, kind: str, *changes: tuple[str, str]) -> Case:
    """Write the case with changes of its text, and load it; `kind` is that of its FMUs."""
    file = folder / f"{kind}.toml"
    file.write_text(moving_line(("[robot]", f'[robot]\nfmu = "{kind}"'), *changes))
    return load_case(file)
