"""Processes in which FMUs run, forked from one that has made their imports.

`coupling.fmu.worker` starts `python -P -m coupling.fmu.worker_main FOLDER LIBRARY`; here a process has
imported that module, and for each order a fork of it becomes such a process.  Tests that are about these
processes ask for the fixture `started_workers`.
"""

import contextlib
import functools
import importlib
import json
import os
import runpy
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Mapping, Sequence
from typing import Any, BinaryIO

# What the module imports, and FMUs in Python.
_MODULES = ("coupling.fmu.worker_main", "scipy.interpolate", "scipy.integrate", "pinocchio")
_LARGEST = 1 << 17  # of an order [bytes]
_PIPES = 3


class ForkedWorker:
    """What a worker's master uses of `subprocess.Popen`, in its place."""

    def __init__(
        self,
        command: Sequence[str],
        stdin: int,
        stdout: int,
        stderr: BinaryIO,
        env: Mapping[str, str],
    ) -> None:
        assert list(command[1:3]) == ["-P", "-m"]
        told, asked = os.pipe()
        heard, answered = os.pipe()
        order = {"command": command[3:], "environment": dict(env), "folder": os.getcwd()}
        self.pid = _forker().ask(order, (told, answered, stderr.fileno()))
        os.close(told)
        os.close(answered)
        self.stdin, self.stdout = os.fdopen(asked, "wb"), os.fdopen(heard, "rb")
        self.returncode: int | None = None

    def poll(self) -> int | None:
        """Return how it has ended, None where it runs."""
        if self.returncode is None:
            self.returncode = _forker().ask({"ended": self.pid})
        return self.returncode

    def kill(self) -> None:
        if self.poll() is None:
            with contextlib.suppress(ProcessLookupError):
                os.kill(self.pid, signal.SIGKILL)

    def wait(self, timeout: float = 60.0) -> int:
        end = time.monotonic() + timeout
        while (status := self.poll()) is None:
            if time.monotonic() > end:
                raise subprocess.TimeoutExpired("worker", timeout)
            time.sleep(0.002)
        return status


class Forker:
    """The process that forks them."""

    def __init__(self) -> None:
        self._orders, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        self._lock = threading.Lock()
        with theirs:
            number = theirs.fileno()
            command = [sys.executable, "-P", __file__, str(number)]
            subprocess.Popen(command, pass_fds=[number], stdin=subprocess.DEVNULL)

    def ask(self, order: dict[str, Any], files: Sequence[int] = ()) -> Any:
        """Return the answer to an order, which takes files along."""
        with self._lock:
            socket.send_fds(self._orders, [json.dumps(order).encode()], files)
            return json.loads(self._orders.recv(_LARGEST))


@functools.cache
def _forker() -> Forker:
    return Forker()


def serve(orders: socket.socket) -> None:
    """Fork for each order, until there is nobody who gives one."""
    while True:
        order, files, *_ = socket.recv_fds(orders, _LARGEST, _PIPES)
        if not order:
            return
        told = json.loads(order)
        if "ended" in told:
            pid, status = os.waitpid(told["ended"], os.WNOHANG)
            answer = os.waitstatus_to_exitcode(status) if pid else None
        else:
            answer = os.fork()
            if answer == 0:
                orders.close()
                become(told, files)
            for file in files:
                os.close(file)
        orders.send(json.dumps(answer).encode())


def become(order: dict[str, Any], files: Sequence[int]) -> None:
    """Be as a process that was started with the command."""
    signal.signal(signal.SIGINT, signal.default_int_handler)
    os.chdir(order["folder"])
    os.environ.clear()
    os.environ.update(order["environment"])
    for own, file in enumerate(files):
        os.dup2(file, own)
        os.close(file)
    sys.argv = order["command"]
    runpy.run_module(order["command"][0], run_name="__main__")


if __name__ == "__main__":
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    for module in _MODULES:
        importlib.import_module(module)
    # What is forked has the module's own `__main__`.
    del sys.modules[_MODULES[0]]
    serve(socket.socket(fileno=int(sys.argv[1])))
