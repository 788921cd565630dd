"""The store: computed once, whole or not at all, and no fault of the disk loses an answer."""

import errno
import json
import os
import threading
import time
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pytest
from killing import begin, die_while_keeping, wait_until

from coupling.errors import ProcessError, StoreError
from coupling.events import Event, WarningEvent
from coupling.files import atomic_file
from coupling.path.histories import ToolPath, WrenchHistory
from coupling.process import ProcessResponse
from coupling.results.run_state import StoredAnswer
from coupling.store import EvaluatedProcess, Store, WaitingForOther
from coupling.store.entry import evaluation_key


def path(shift: float = 0.0) -> ToolPath:
    pose = np.tile([shift, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0], (50, 1))
    return ToolPath(np.linspace(0.0, 1.0, 50), pose)


@dataclass
class Springs:
    """A process that counts its evaluations."""

    identity: str = "springs"
    seconds: float = 0.0
    asked: list[float] = field(default_factory=list)

    def evaluate(self, path: ToolPath) -> ProcessResponse:
        self.asked.append(float(path.pose[0, 0, 0]))
        time.sleep(self.seconds)
        return ProcessResponse(WrenchHistory.of_forces(path.time, [2e5 * path.position[0]]))


@pytest.fixture
def told() -> list[Event]:
    return []


@pytest.fixture
def store(tmp_path, told) -> Store:
    return Store(tmp_path / "store", told.append)


def test_a_path_is_evaluated_once_by_all_who_ask(store, told):
    springs = [Springs(), Springs()]
    found = [
        EvaluatedProcess(s, store, told.append).evaluate(path()) for s in (*springs, springs[0])
    ]
    assert [s.asked for s in springs] == [[0.0], []]
    assert all(np.array_equal(a.wrench.wrench, found[0].wrench.wrench) for a in found)
    assert [event.origin for event in told] == ["computed", "store", "store"]
    assert {event.key for event in told} == {evaluation_key("springs", path())}


def test_a_store_is_of_processes_that_answer_alike(store):
    for identity in ("springs", "other springs"):
        springs = Springs(identity)
        EvaluatedProcess(springs, store).evaluate(path())
        EvaluatedProcess(springs, store).evaluate(path(1e-12))
        assert springs.asked == [0.0, 1e-12]
    assert len(store.entries()) == 4


def test_a_process_that_nobody_knows_is_evaluated_every_time(store):
    springs = Springs(identity="")
    for _ in range(2):
        EvaluatedProcess(springs, store).evaluate(path())
    assert len(springs.asked) == 2
    assert not store.folder.exists()


def test_without_a_store_keys_are_told_all_the_same(told):
    process = EvaluatedProcess(Springs(), None, told.append)
    for _ in range(2):
        process.evaluate(path())
    assert [(e.origin, e.key) for e in told] == [
        ("computed", evaluation_key("springs", path()))
    ] * 2


def test_a_process_that_fails_leaves_nothing(store):
    class Failing(Springs):
        def evaluate(self, path: ToolPath) -> ProcessResponse:
            raise ProcessError("no licence")

    with pytest.raises(ProcessError, match="no licence"):
        EvaluatedProcess(Failing(), store).evaluate(path())
    assert [f.name for f in store.folder.iterdir()] == ["locks"]
    springs = Springs()  # and nobody waits for it
    EvaluatedProcess(springs, store).evaluate(path())
    assert len(springs.asked) == 1


def entry_of(store: Store) -> Path:
    (entry,) = store.entries()
    return entry.file


def flip(file: Path) -> None:
    content = bytearray(file.read_bytes())
    content[len(content) // 2] ^= 4
    file.write_bytes(content)


DAMAGES = {
    "truncated": lambda file: file.write_bytes(file.read_bytes()[:-1]),
    "empty": lambda file: file.write_bytes(b""),
    "flipped": flip,
    "something else": lambda file: file.write_text("results of mine"),
}


@pytest.mark.parametrize("damage", DAMAGES)
def test_a_damaged_entry_is_set_aside_named_and_computed_anew(store, told, damage):
    first = EvaluatedProcess(Springs(), store).evaluate(path())
    file = entry_of(store)
    DAMAGES[damage](file)
    left, springs = file.read_bytes(), Springs()
    again = EvaluatedProcess(springs, store).evaluate(path())
    assert len(springs.asked) == 1
    assert np.array_equal(again.wrench.wrench, first.wrench.wrench)
    assert file.with_suffix(".damaged").read_bytes() == left
    (warning,) = told
    assert isinstance(warning, WarningEvent)
    assert str(file) in warning.text
    assert "set aside" in warning.text
    assert entry_of(store).read_bytes() != left


def rewritten(file: Path, **changes) -> None:
    """Change arrays of an entry, or the period, as another writer would: its checksums are right."""
    with np.load(file) as kept:
        arrays = {name: kept[name] for name in kept.files}
    header = json.loads(str(arrays["header"]))
    for name, change in changes.items():
        if name == "period":
            header["period"] = change
        else:
            arrays[name] = change(arrays.get(name))
    header["arrays"] = [name for name in arrays if name != "header"]
    np.savez(file, **{**arrays, "header": np.array(json.dumps(header))})


FOREIGN = {
    "fewer rows": {"time": lambda t: t[:-3], "wrench": lambda w: w[:, :-3]},
    "a single row": {"time": lambda t: t[:1], "wrench": lambda w: w[:, :1]},
    "times of its own": {"time": lambda t: 2.0 * t},
    "forces alone": {"wrench": lambda w: w[..., :3]},
    "another tool": {"wrench": lambda w: np.repeat(w, 2, axis=0)},
    "not a number": {"wrench": lambda w: np.nan * w},
    "single precision": {"wrench": lambda w: w.astype(np.float32)},
    "whole numbers": {"wrench": lambda w: w.astype(np.int64)},
    "truth values": {"wrench": lambda w: w.astype(bool)},
    "complex numbers": {"wrench": lambda w: w.astype(complex)},
    "letters": {"wrench": lambda w: w.astype(str)},
    "a stiffness of fewer rows": {"stiffness": lambda _: np.zeros((3, 3, 3))},
    "an infinite stiffness": {"stiffness": lambda _: np.full((50, 3, 3), np.inf)},
    "a period in words": {"period": "short"},
    "a period before time": {"period": -1.0},
}


@pytest.mark.parametrize("difference", FOREIGN)
def test_an_entry_that_does_not_answer_its_path_is_set_aside_and_computed_anew(
    store, told, difference
):
    """As another version may have written it, under the right name and whole."""
    first = EvaluatedProcess(Springs(), store).evaluate(path(0.3))
    file = entry_of(store)
    rewritten(file, **FOREIGN[difference])
    springs = Springs()
    again = EvaluatedProcess(springs, store, told.append).evaluate(path(0.3))
    assert springs.asked == [0.3]
    assert np.array_equal(again.wrench.wrench, first.wrench.wrench)
    (warning,) = [event for event in told if isinstance(event, WarningEvent)]
    assert "set aside" in warning.text
    assert [entry.problem() for entry in store.entries()] == [""]


@pytest.mark.parametrize("stage", ["opened", "written", "synced", "renamed"])
def test_a_process_killed_while_it_keeps_an_answer_leaves_it_whole_or_not_at_all(store, stage):
    child = begin(die_while_keeping, store.folder, stage)
    child.join()
    assert child.exitcode == -9
    springs = Springs()
    found = EvaluatedProcess(springs, store).evaluate(path())
    assert len(springs.asked) == (0 if stage == "renamed" else 1)
    assert np.array_equal(found.wrench.force[0], 2e5 * path().position[0])
    assert [entry.problem() for entry in store.entries()] == [""]
    assert list(store.folder.glob("*.partial")) == []


def test_two_at_once_compute_once_and_the_other_is_told_for_whom_it_waits(store, told):
    slow, quick = Springs(seconds=0.5), Springs()
    first = threading.Thread(target=EvaluatedProcess(slow, store).evaluate, args=(path(),))
    first.start()
    wait_until(lambda: slow.asked)
    answer = EvaluatedProcess(quick, store, told.append).evaluate(path())
    first.join()
    assert (slow.asked, quick.asked) == ([0.0], [])
    assert np.array_equal(answer.wrench.force[0], 2e5 * path().position[0])
    waits, answered = told
    assert isinstance(waits, WaitingForOther)
    assert f"waiting for process {os.getpid()} on {os.uname().nodename}, since" in waits.text
    assert (answered.origin, answered.seconds > 0.2) == ("store", True)


def test_who_waits_for_one_that_fails_computes_itself(store):
    class Failing(Springs):
        def evaluate(self, path: ToolPath) -> ProcessResponse:
            super().evaluate(path)
            raise ProcessError("no licence")

    failing, springs = Failing(seconds=0.3), Springs()

    def fail() -> None:
        with pytest.raises(ProcessError):
            EvaluatedProcess(failing, store).evaluate(path())

    first = threading.Thread(target=fail)
    first.start()
    wait_until(lambda: failing.asked)
    EvaluatedProcess(springs, store).evaluate(path())
    first.join()
    assert len(springs.asked) == 1


def test_no_room_is_found_before_the_work(store, monkeypatch):
    """As a full disk says it where room is asked for."""

    def full(*_: object) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    springs = Springs()
    monkeypatch.setattr(atomic_file.os, "posix_fallocate", full)
    with pytest.raises(StoreError, match=r"store cannot be written: No space left on device"):
        EvaluatedProcess(springs, store).evaluate(path())
    assert springs.asked == []
    assert [f.name for f in store.folder.iterdir()] == ["locks"]


def test_an_answer_that_cannot_be_kept_is_used_and_kept_as_soon_as_it_can_be(
    store, told, monkeypatch
):
    def full(*_: object) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    springs = Springs()
    process = EvaluatedProcess(springs, store, told.append)
    with monkeypatch.context() as faults:
        faults.setattr(atomic_file.os, "fsync", full)
        answer = process.evaluate(path())
        assert np.array_equal(process.evaluate(path()).wrench.wrench, answer.wrench.wrench)
    assert (springs.asked, process.not_stored, store.entries()) == ([0.0], 1, [])
    warnings = [event.text for event in told if isinstance(event, WarningEvent)]
    assert len(warnings) == 1
    assert "No space left on device; the result is used" in warnings[0]
    process.settle()
    assert (process.not_stored, len(store.entries())) == (0, 1)
    EvaluatedProcess(springs, store).evaluate(path())
    assert len(springs.asked) == 1


def test_a_full_disk_is_a_clear_error_and_loses_nothing(small_disk):
    store, springs = Store(small_disk / "store"), Springs()
    process = EvaluatedProcess(springs, store)
    process.evaluate(path())
    (small_disk / "other files").write_bytes(b"\0" * 2_000_000)
    with pytest.raises(StoreError, match=r"disk/store: the store cannot be written: No space left"):
        process.evaluate(path(1.0))
    assert springs.asked == [0.0]
    assert [entry.problem() for entry in store.entries()] == [""]
    process.evaluate(path())
    (small_disk / "other files").unlink()
    process.evaluate(path(1.0))
    assert springs.asked == [0.0, 1.0]


def test_a_place_that_cannot_be_one_is_named(tmp_path):
    (tmp_path / "file").write_text("")
    for place in (tmp_path / "file", tmp_path / "file" / "store", Path("/proc/store")):
        with pytest.raises(StoreError, match=f"{place}"):
            EvaluatedProcess(Springs(), Store(place)).evaluate(path())


def test_the_lock_of_a_killed_process_is_free(store):
    child = begin(die_while_keeping, store.folder, "opened")
    child.join()
    owner = next((store.folder / "locks").glob("*.owner"))
    assert json.loads(owner.read_text())[1] == child.pid
    started = time.monotonic()
    EvaluatedProcess(Springs(), store).evaluate(path())
    assert time.monotonic() - started < 5.0


def test_an_entry_is_used_last_when_it_is_read_last(store):
    process = EvaluatedProcess(Springs(), store)
    for k in range(3):
        process.evaluate(path(k))
    for age, entry in enumerate(store.entries()):
        os.utime(entry.file, (1e9 + age, 1e9 + age))
    process.evaluate(path(1))
    assert store.entries()[-1].key == evaluation_key("springs", path(1))


def test_an_answered_event_says_how_long_it_took(store, told):
    EvaluatedProcess(Springs(seconds=0.1), store, told.append).evaluate(path())
    (answered,) = told
    assert isinstance(answered, StoredAnswer)
    assert answered.seconds >= 0.1
