"""What Sphinx needs to know; `make site` builds."""

from __future__ import annotations

import re
from typing import Any

import elastic_robot

project = "elastic-robot-fmu"
author = "The elastic-robot-fmu authors"
version = release = elastic_robot.__version__

extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon", "docs.site.mathml"]
root_doc = "index"
myst_heading_anchors = 6
myst_enable_extensions = ["dollarmath"]
myst_fence_as_directive = ["math"]
default_role = "code"
highlight_language = "none"  # what commands print is no program
add_module_names = False  # the page has it, as it is imported
autodoc_typehints = "description"
autodoc_typehints_description_target = "documented"
napoleon_google_docstring = True
napoleon_numpy_docstring = False
napoleon_use_ivar = True
# Annotations name classes without their modules, and some names are in two: those stay without a link.
suppress_warnings = ["ref.python"]

html_theme = "furo"
html_title = f"{project} {version}"
html_favicon = "../icon.svg"
html_static_path = ["static"]
html_css_files = ["tables.css"]
html_copy_source = False
html_show_sphinx = False


def _as_plain_text(
    app: Any, what: str, name: str, shown: object, options: object, lines: list[str]
) -> None:
    """Escape what a docstring of plain text means nothing special by: *, | and x_."""
    for k, line in enumerate(lines):
        if not line.lstrip().startswith((">>>", "...")):
            parts = re.split(r"(`[^`]*`)", line)
            parts[::2] = [re.sub(r"(?<!\\)([*|]|_(?!\w))", r"\\\1", part) for part in parts[::2]]
            lines[k] = "".join(parts)


def setup(app: Any) -> None:
    """Read docstrings as they are meant, before their sections are."""
    app.connect("autodoc-process-docstring", _as_plain_text, priority=100)
