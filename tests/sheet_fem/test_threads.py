"""Loops of the sheet on all cores: every row once, whatever the number of cores; forked processes."""

import multiprocessing
import subprocess
import sys

import pytest
from filelock import FileLock

from coupling.native.cache import cache_folder
from coupling.sheet_fem import threads
from coupling.sheet_fem.threads import in_threads


@pytest.mark.parametrize("count", [1, 2, 3, 64])
@pytest.mark.parametrize(("size", "step"), [(0, 1), (1, 1), (7, 2), (64, 32), (65, 32), (100, 7)])
def test_every_row_is_in_one_share_that_begins_at_a_multiple_of_the_step(
    monkeypatch, count, size, step
):
    monkeypatch.setattr(threads, "COUNT", count)
    shares = []
    in_threads(shares.append, size, step)
    assert sorted(row for share in shares for row in range(size)[share]) == list(range(size))
    assert all(share.start % step == 0 for share in shares)


def test_an_error_in_a_thread_is_raised():
    def fail(share):
        raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        in_threads(fail, 10)


def _use() -> None:
    in_threads(lambda share: None, 100)


@pytest.mark.skipif(sys.platform == "win32", reason="Windows forks no processes")
@pytest.mark.filterwarnings("ignore::DeprecationWarning")
def test_a_forked_process_has_threads_of_its_own():
    """Those of its parent are not there: it would wait for them for ever."""
    _use()
    child = multiprocessing.get_context("fork").Process(target=_use)
    child.start()
    child.join(30.0)
    left = child.is_alive()
    child.kill()
    assert not left
    assert child.exitcode == 0


SCRIPT = """
from coupling.sheet_fem.compiled import compile_function
print("begun", flush=True)
@compile_function
def twice(x):
    return x + x
print(twice(1.5), flush=True)
"""


def test_a_process_compiles_when_no_other_does(tmp_path):
    """numba itself would let both write their code under the same name."""
    (tmp_path / "script.py").write_text(SCRIPT, encoding="utf-8")
    with FileLock(cache_folder() / "sheet_fem.lock"):
        process = subprocess.Popen(
            [sys.executable, str(tmp_path / "script.py")], stdout=subprocess.PIPE, text=True
        )
        assert process.stdout is not None
        assert process.stdout.readline() == "begun\n"
        with pytest.raises(subprocess.TimeoutExpired):
            process.wait(2.0)
    assert process.stdout.read() == "3.0\n"
    assert process.wait() == 0
