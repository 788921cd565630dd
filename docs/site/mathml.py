"""A Sphinx extension: formulas as MathML, which browsers draw without a script or a network."""

from __future__ import annotations

import re
from typing import Any

from docutils import nodes
from latex2mathml.converter import convert
from sphinx.util import logging


def mathml(latex: str, display: str) -> str:
    """Return a formula as MathML; warn of a command that the converter has left as it was."""
    # The converter takes what is typed as it stands, where LaTeX wants an underscore escaped.
    typed = re.sub(r"\\texttt\{[^}]*\}", lambda text: text[0].replace(r"\_", "_"), latex)
    found = convert(typed, display=display)
    if "\\" in re.sub(r"<[^>]*>", "", found):
        logging.getLogger(__name__).warning(f"{latex}: expected LaTeX that can be drawn")
    return found


def _inline(writer: Any, node: nodes.math) -> None:
    writer.body.append(mathml(node.astext(), "inline"))
    raise nodes.SkipNode


def _display(writer: Any, node: nodes.math_block) -> None:
    writer.body.append(f'<div class="math">{mathml(node.astext(), "block")}</div>')
    raise nodes.SkipNode


def setup(app: Any) -> dict[str, bool]:
    """Register the renderer, which Sphinx then takes for HTML."""
    app.add_html_math_renderer("mathml", (_inline, None), (_display, None))
    app.config.html_math_renderer = "mathml"
    return {"parallel_read_safe": True, "parallel_write_safe": True}
