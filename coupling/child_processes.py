"""All processes that a program has started, also those that have left its session or lost a parent."""

from __future__ import annotations

import contextlib
import os
import time
from collections.abc import Mapping

import psutil

_MARK = "ELASTIC_ROBOT_PROCESS_TREE"
# Looks for processes that were started while the others were ended.
_LOOKS = 5
_BETWEEN_LOOKS = 0.02  # [s]


def marked_environment(mark: str) -> Mapping[str, str]:
    """Return this process's environment with a mark by which `ProcessTree` finds who inherits it."""
    return {**os.environ, _MARK: mark}


def inherited_mark() -> str:
    """Return the mark of the tree that this process belongs to, empty where it belongs to none."""
    return os.environ.get(_MARK, "")


class ProcessTree:
    """A process and all that it has started, told by their parents and by the environment they inherit.

    A child that calls setsid leaves its group, and one whose parent has ended has another parent; both
    keep their environment.  macOS shows that of its own programs to nobody.  This process and its
    threads are never part of a tree.

    Args:
        root: Number of the process; None: those alone that have the mark.
        mark: Text that `marked_environment` has put into its environment.

    Example:
        >>> import subprocess, sys
        >>> sleep = [sys.executable, "-c", "import time; time.sleep(60)"]
        >>> process = subprocess.Popen(sleep, env=marked_environment("example"))
        >>> ProcessTree(process.pid, "example").kill()
        >>> process.wait() != 0
        True
    """

    def __init__(self, root: int | None, mark: str) -> None:
        self._root, self._mark = root, mark
        self._members: set[psutil.Process] = set()

    def end(self, grace: float) -> None:
        """Ask all processes to end, and kill those that have not done so after some time [s]."""
        for member in self._look():
            with contextlib.suppress(psutil.Error):
                member.terminate()
        end = time.monotonic() + grace
        while time.monotonic() < end and self._look():
            time.sleep(_BETWEEN_LOOKS)
        self.kill()

    def kill(self) -> None:
        """End all processes, also those that are started meanwhile."""
        for _ in range(_LOOKS):
            members = self._look()
            if not members:
                return
            for member in members:
                with contextlib.suppress(psutil.Error):
                    member.kill()
            time.sleep(_BETWEEN_LOOKS)

    def _look(self) -> set[psutil.Process]:
        """Return the processes that run; those seen once stay members, whoever their parent is now."""
        running = {process.pid: process for process in psutil.process_iter()}
        for process in running.values():
            if process.pid == self._root or self._has_mark(process):
                self._members.add(process)
        numbers = {member.pid for member in self._members if _runs(member)}
        while True:
            children = {
                pid
                for pid, process in running.items()
                if pid not in numbers and _parent(process) in numbers
            }
            if not children:
                break
            numbers |= children
            self._members |= {running[pid] for pid in children}
        return {member for member in self._members if member.pid != os.getpid() and _runs(member)}

    def _has_mark(self, process: psutil.Process) -> bool:
        try:
            return bool(process.environ().get(_MARK) == self._mark)
        except (psutil.Error, OSError):  # another user's, or it has just ended
            return False


def _runs(process: psutil.Process) -> bool:
    """Return whether a process still runs; one that waits for its parent to notice its end does not."""
    try:
        return bool(process.is_running() and process.status() != psutil.STATUS_ZOMBIE)
    except psutil.Error:
        return False


def _parent(process: psutil.Process) -> int:
    try:
        return int(process.ppid())
    except psutil.Error:
        return 0
