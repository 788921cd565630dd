"""Clearing a store by age and size, with what killed processes have left in it."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path

from filelock import FileLock, Timeout

from coupling.errors import StoreError
from coupling.files.whole_file import PARTIAL
from coupling.store.store import DAMAGED, ENTRY, LOCKS, Entry, Store


def to_clear(
    entries: Sequence[Entry], now: float, older_than: float | None, keep: int | None
) -> list[Entry]:
    """Return the entries to remove: those not used for a time, and the oldest beyond a size.

    Args:
        entries: All entries, the one that was used last at the end.
        now: [s since 1970].
        older_than: Time without use after which an entry goes [s]; None: none goes for its age.
        keep: Size of the entries that may stay [bytes]; None: any.

    Example:
        >>> entries = [Entry(Path(f"{k}"), 10, float(k), None) for k in range(4)]
        >>> [entry.file.name for entry in to_clear(entries, 4.0, 2.5, None)]
        ['0', '1']
        >>> [entry.file.name for entry in to_clear(entries, 4.0, None, 25)]
        ['0', '1']
    """
    left = sum(entry.size for entry in entries)
    found = []
    for entry in entries:
        too_old = older_than is not None and now - entry.used > older_than
        too_much = keep is not None and left > keep
        if too_old or too_much:
            found.append(entry)
            left -= entry.size
    return found


def clear(store: Store, entries: Sequence[Entry]) -> None:
    """Remove entries, entries that were set aside, and what killed processes have left.

    Raises:
        StoreError: If a file cannot be removed.
    """
    try:
        for entry in entries:
            entry.file.unlink(missing_ok=True)
        for file in _left(store.folder):
            key = file.name.split(".")[0]
            lock = FileLock(store.folder / LOCKS / f"{key}.lock")
            with suppress(Timeout), lock.acquire(timeout=0):
                file.unlink(missing_ok=True)
        for file in (store.folder / LOCKS).glob("*.lock"):
            with suppress(Timeout), FileLock(file).acquire(timeout=0):
                file.unlink()
                file.with_suffix(".owner").unlink(missing_ok=True)
    except OSError as cause:
        raise StoreError(f"{store.folder}: cannot be cleared: {cause.strerror or cause}") from cause


def _left(folder: Path) -> list[Path]:
    """Return files of answers that were never finished, and of damaged ones."""
    partial = folder.glob(f"*{ENTRY}.*{PARTIAL}")
    return [*partial, *folder.glob(f"*{DAMAGED}")]
