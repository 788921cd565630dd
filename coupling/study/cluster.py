"""Samples on many processes by Dask: a local cluster, or one that runs already."""

from __future__ import annotations

import logging
import os
import shutil
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import CancelledError
from contextlib import contextmanager, suppress
from functools import cache
from hashlib import sha256
from pathlib import Path
from typing import Any
from uuid import uuid4

import elastic_robot
from coupling.errors import HostError, StudyError
from coupling.results.study_result import StudySample
from coupling.study.robot_pool import RETRIES, RobotPool, StudyJob, Workers, ended_again
from elastic_robot import fingerprint

try:
    import dask
    from distributed import (
        Client,
        KilledWorker,
        LocalCluster,
        WorkerPlugin,
        as_completed,
        get_worker,
    )
    from distributed.comm import CommClosedError
    from distributed.utils import silence_logging_cmgr
except ImportError as cause:
    raise StudyError(
        "a study needs Dask, which is not installed: pip install 'elastic-robot-fmu[study]'"
    ) from cause

# Above all levels of the log: a client that leaves while it is written to, as one does with an
# interrupt, is critical to the scheduler.
_SILENT_LEVEL = logging.CRITICAL + 1
# How long a cluster is waited for [s].
_CLUSTER_TIMEOUT = 10.0
# This package's name, and in a wheel that of the one it lies in.
_PACKAGES = {__name__.partition(".")[0], __name__.removesuffix(".study.cluster")}
# Variable with which Python does not import from the working folder.
_SAFE_PATH = "PYTHONSAFEPATH"


class _Keeper(WorkerPlugin):  # type: ignore[misc]  # Dask is not typed
    """Keeps a bench in a worker: loaded with its first sample, ended with the study."""

    def __init__(self, name: str, work: StudyJob) -> None:
        self.name, self._work = name, work
        self._bench: RobotPool | None = None

    def __getstate__(self) -> dict[str, Any]:
        return {**self.__dict__, "_bench": None}

    @property
    def bench(self) -> RobotPool:
        if self._bench is None:
            self._bench = RobotPool(self._work)
        return self._bench

    def teardown(self, worker: object) -> None:
        if self._bench is not None:
            self._bench.close()
            self._bench = None


def _simulate_sample(name: str, version: str, number: int, values: Sequence[float]) -> StudySample:
    """Return a sample; runs in a worker, which may have come after the others were asked."""
    worker = get_worker()
    _require_same(version, {worker.address: _version()})
    keeper: _Keeper = worker.plugins[name]
    return keeper.bench.sample(number, values)


@cache
def _version() -> str:
    """Return which version of this package runs here: its number, and a hash of its sources."""
    folders = Path(elastic_robot.__path__[0]), Path(__file__).parents[1]
    sources = "-".join(fingerprint.fingerprint(folder)[:8] for folder in folders)
    return f"{elastic_robot.__version__} with sources {sources}"


def _require_same(version: str, of_workers: Mapping[str, str | Exception]) -> None:
    """Refuse workers of another version than the study's."""
    for address, other in of_workers.items():
        if isinstance(other, ModuleNotFoundError) and other.name in _PACKAGES:
            raise other
        if other != version:
            said = f"one that cannot be read ({other!r})" if isinstance(other, Exception) else other
            raise StudyError(
                f"worker {address}: expected elastic-robot-fmu {version}, got {said}: install the same"
                " there, start the worker again, and give the same command"
            )


def simulate(
    work: StudyJob, points: Mapping[int, Sequence[float]], workers: Workers, place: Path
) -> Iterator[StudySample]:
    """Give every sample as soon as it is done, in any order.

    A worker that ends costs its task, which another one takes.

    Raises:
        StudyError: If the cluster cannot be reached, has another version of
            this package or none, or ends.
    """
    if not points:
        return
    name = f"elastic-robot-{uuid4().hex}"
    with _client(workers, min(workers.count, len(points)), place) as client:
        try:
            _require_same(_version(), client.run(_version, on_error="return"))
            with _register_bench(client, _Keeper(name, work), bool(workers.scheduler)):
                futures = [
                    client.submit(
                        _simulate_sample,
                        name,
                        _version(),
                        number,
                        list(values),
                        key=f"{name}-{number}",
                        retries=RETRIES,
                        pure=False,
                    )
                    for number, values in points.items()
                ]
                for future in as_completed(futures):
                    yield future.result()
                    future.release()
        except KilledWorker as cause:
            raise StudyError(
                f"workers ended repeatedly on one sample ({cause.task}): check that their memory"
                " suffices; finished samples are kept, the same command continues"
            ) from cause
        except (CommClosedError, CancelledError, TimeoutError) as cause:
            where = f" at {workers.scheduler}" if workers.scheduler else ""
            raise StudyError(
                f"the Dask scheduler{where} has ended, or cannot be reached any more: start it again;"
                " finished samples are kept, the same command continues"
            ) from cause
        except HostError as cause:
            raise ended_again(cause) from cause
        except ModuleNotFoundError as cause:
            raise StudyError(
                f"{workers.scheduler}: its workers cannot import this package: {cause}: install"
                " elastic-robot-fmu there"
            ) from cause


@contextmanager
def _register_bench(client: Client, keeper: _Keeper, shared: bool) -> Iterator[None]:
    """Have all workers keep a bench, and end it afterwards where the workers themselves go on."""
    client.register_plugin(keeper, name=keeper.name)
    try:
        yield
    finally:
        if shared:
            with suppress(Exception):  # a scheduler that has ended must not hide that it has
                client.unregister_worker_plugin(keeper.name)


@contextmanager
def _client(workers: Workers, count: int, place: Path) -> Iterator[Client]:
    """Give a client of the workers, a local cluster's ended afterwards."""
    if workers.scheduler:
        # What Dask says of a scheduler that ends is said in a sentence.
        with silence_logging_cmgr(_SILENT_LEVEL), _connect(workers.scheduler) as client:
            yield client
        return
    # What a killed study left is found by its name.
    digest = sha256(str(place.resolve()).encode()).hexdigest()[:16]
    scratch = Path(tempfile.gettempdir(), f"elastic_robot_study_{digest}")
    shutil.rmtree(scratch, ignore_errors=True)
    scratch.mkdir(parents=True)
    quiet = {"distributed.worker.use-file-locking": False, "distributed.admin.log-format": ""}
    try:
        with (
            dask.config.set(quiet),
            _safe_path() as before,
            LocalCluster(
                n_workers=count,
                threads_per_worker=1,
                processes=True,
                dashboard_address="127.0.0.1:0",
                local_directory=str(scratch),
                silence_logs=_SILENT_LEVEL,
                env={"TMPDIR": str(scratch)},
            ) as cluster,
            Client(cluster) as client,
        ):
            client.register_plugin(_SafePath(before))
            yield client
    finally:
        shutil.rmtree(scratch, ignore_errors=True)


@contextmanager
def _safe_path() -> Iterator[str | None]:
    """Keep each Python that is started from importing a user's random.py in the working folder."""
    before = os.environ.get(_SAFE_PATH)
    os.environ[_SAFE_PATH] = "1"
    try:
        yield before
    finally:
        _set_safe_path(before)


def _set_safe_path(value: str | None) -> None:
    os.environ.pop(_SAFE_PATH, None)
    if value is not None:
        os.environ[_SAFE_PATH] = value


class _SafePath(WorkerPlugin):  # type: ignore[misc]  # Dask is not typed
    """Gives a worker that has started its variable back: a user's program may need what is beside it."""

    def __init__(self, value: str | None) -> None:
        self._value = value

    def setup(self, worker: object) -> None:
        """Do so."""
        _set_safe_path(self._value)


def _connect(address: str) -> Client:
    try:
        client = Client(address, timeout=_CLUSTER_TIMEOUT)
    except (OSError, ValueError, TimeoutError) as cause:
        raise StudyError(
            f"--scheduler: expected a Dask scheduler at {address}, got no answer within"
            f" {_CLUSTER_TIMEOUT:.0f} s: start one (dask scheduler, dask worker ADDRESS), or omit"
            " --scheduler for a local cluster"
        ) from cause
    try:
        client.wait_for_workers(1, timeout=_CLUSTER_TIMEOUT)
    except TimeoutError as cause:
        client.close()
        raise StudyError(
            f"--scheduler: expected workers at {address}, got none within {_CLUSTER_TIMEOUT:.0f} s:"
            f" start some (dask worker {address} --nthreads 1)"
        ) from cause
    return client
