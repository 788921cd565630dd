"""Files that are whole or not there: what may stand in their place."""

from __future__ import annotations

import os
import time

import pytest

from coupling.files import atomic_file
from coupling.files.atomic_file import AtomicFile, write_atomically


class OwnError(Exception):
    """What a caller asks for."""


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="needs pipes with names")
def test_a_pipe_or_a_device_is_not_replaced(tmp_path):
    """Else who may do all would have a file in the place of /dev/null."""
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    with pytest.raises(OwnError, match=r"pipe: cannot be written: expected a file .* got a device"):
        write_atomically(pipe, "text", OwnError)
    assert pipe.is_fifo()
    assert os.listdir(tmp_path) == ["pipe"]


def test_a_folder_is_refused_before_the_work(tmp_path):
    with pytest.raises(OSError, match="expected a file or a new name, got a folder"):
        AtomicFile(tmp_path)


def test_behind_a_link_the_file_that_it_leads_to_is_replaced(tmp_path):
    there, link = tmp_path / "there.html", tmp_path / "link.html"
    there.write_text("old")
    link.symlink_to(there)
    write_atomically(link, "new", OwnError)
    assert link.is_symlink()
    assert there.read_text() == "new"


@pytest.fixture(params=["locks", "none"])
def age(request, monkeypatch):
    """Age of what a killed command has left [s]; without locks, what is new may be another one's."""
    if request.param == "none":
        monkeypatch.setattr(atomic_file, "fcntl", None)
        return 100.0
    return pytest.importorskip("fcntl") and 0.0


def test_what_a_killed_command_has_left_of_a_file_goes_with_the_next_one(tmp_path, age):
    """Not what another one writes, what is of another file, or what only looks like it."""
    page = tmp_path / "page.html"
    left, of_another = (tmp_path / f"page.{end}.{'a' * 32}.partial" for end in ("html", "htm"))
    lookalike = tmp_path / "page.html.mine.partial"
    for file in (left, of_another, lookalike):
        file.write_text("half")
        os.utime(file, (time.time() - age,) * 2)
    writing = AtomicFile(page)
    assert not left.exists()
    write_atomically(page, "whole", OwnError)
    assert of_another.exists()
    assert lookalike.exists()
    writing.write([b"of the other one"])
    assert page.read_bytes() == b"of the other one"
