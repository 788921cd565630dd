"""What a notebook shows of results: their first screens and, where something moves, the scene."""

import html
import re
import time

import pytest
from browser import NEEDS_CHROMIUM, chromium
from line_case import line_case
from reported import compensated

from coupling.errors import ResultError
from coupling.report.notebook import read_result
from coupling.run.execute import Run
from coupling.run.stored_run import StoredRun


@pytest.fixture(scope="module")
def shown(tmp_path_factory) -> tuple[Run, StoredRun]:
    folder = tmp_path_factory.mktemp("notebook")
    _, run, out = compensated(folder, line_case(folder, "native"))
    stored = read_result(out)
    assert isinstance(stored, StoredRun)
    return run, stored


def page_of(shown: object) -> str:
    """Return the page within what a notebook shows."""
    text = shown._repr_html_()
    assert text is not None
    return html.unescape(re.search(r'srcdoc="([^"]*)"', text)[1])


def test_a_run_and_its_parts_show_first_screen_and_space(shown):
    run, stored = shown
    figures = stored.figures
    for part in (run, stored, stored.first):
        page = page_of(part)
        assert 'data-scene="first_scene"' in page
        assert "plotly" not in page.partition("</style>")[2].partition("<script>")[0]
        assert len(page) < 1_000_000
    assert "on the real robot" in page_of(stored)
    assert figures.case in page_of(stored.first)


def test_what_is_no_result_is_refused(tmp_path):
    with pytest.raises(ResultError, match="expected the folder of a run, a study"):
        read_result(tmp_path)


@NEEDS_CHROMIUM
def test_a_view_in_a_notebook_is_drawn(shown, tmp_path):
    page = tmp_path / "notebook.html"
    page.write_text(f"<!DOCTYPE html><html><body>{shown[1]._repr_html_()}</body></html>")
    with chromium(tmp_path / "profile") as driver:
        driver.get(page.as_uri())
        inside = "document.querySelector('iframe').contentDocument"
        deadline = time.monotonic() + 60.0
        while not driver.execute_script(f"return {inside}.documentElement.dataset.drawn"):
            assert time.monotonic() < deadline
            time.sleep(0.05)
        assert driver.execute_script(f"return {inside}.documentElement.dataset.scene") != "none"
        size = f"return {inside}.querySelector('.stage canvas').getBoundingClientRect().height"
        assert driver.execute_script(size) > 100
