"""Files that are whole or not there; files without end, pipes and devices are refused."""

import os
import signal
import socket
import time
from pathlib import Path

import pytest

from coupling.errors import CaseError
from coupling.files import atomic_file
from coupling.files.atomic_file import AtomicFile, write_atomically
from coupling.files.bounded_file import read_bounded
from coupling.files.csv_table import read_header, read_table
from coupling.files.measured_table import MeasuredTable
from coupling.files.toml_file import load_toml

READERS = {
    "toml": lambda file: load_toml(file, CaseError),
    "header": lambda file: read_header(file, CaseError),
    "table": lambda file: read_table(file, ("time",), CaseError),
    "measured": lambda file: MeasuredTable.read(file, CaseError),
}


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


@pytest.mark.skipif(not Path("/dev/zero").exists(), reason="needs endless devices")
@pytest.mark.parametrize("device", ["/dev/zero", "/dev/urandom", "/dev/null"])
@pytest.mark.parametrize("reader", READERS)
def test_a_device_is_no_file(reader, device):
    with pytest.raises(CaseError, match=f"^{device}: expected a file, got a device"):
        READERS[reader](Path(device))


@pytest.mark.parametrize("reader", READERS)
def test_a_huge_file_is_refused(reader, tmp_path):
    file = tmp_path / "huge"
    with file.open("wb") as stream:
        stream.truncate(2**40)  # sparse: it takes no room
    with pytest.raises(CaseError, match=r"expected a file of at most \d+ MB, got more"):
        READERS[reader](file)


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="needs pipes with names")
@pytest.mark.parametrize("reader", READERS)
def test_a_pipe_that_nobody_writes_to_is_refused_at_once(reader, tmp_path):
    def interrupt(number: int, frame: object) -> None:
        raise TimeoutError("the pipe is waited for")

    os.mkfifo(tmp_path / "pipe")
    before = signal.signal(signal.SIGALRM, interrupt)
    signal.alarm(10)
    try:
        with pytest.raises(CaseError, match="pipe: expected a file, got a pipe: name a file"):
            READERS[reader](tmp_path / "pipe")
    finally:
        signal.alarm(0)
        signal.signal(signal.SIGALRM, before)


@pytest.mark.skipif(not hasattr(socket, "AF_UNIX"), reason="needs sockets with names")
@pytest.mark.parametrize("reader", READERS)
def test_a_socket_is_no_file(reader, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)  # names of sockets are short
    with socket.socket(socket.AF_UNIX) as bound:
        bound.bind("socket")
        with pytest.raises(CaseError, match="socket: expected a file, got a socket: name a file"):
            READERS[reader](Path("socket"))


def test_as_much_as_is_allowed_is_read(tmp_path):
    file = tmp_path / "file"
    file.write_bytes(b"12345")
    assert read_bounded(file, 5, CaseError) == b"12345"
    with pytest.raises(CaseError, match="got more"):
        read_bounded(file, 4, CaseError)
