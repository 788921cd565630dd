"""Files without end, pipes and devices are refused before they fill the memory."""

from __future__ import annotations

import os
import signal
import socket
from pathlib import Path

import pytest

from coupling.errors import CaseError
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
