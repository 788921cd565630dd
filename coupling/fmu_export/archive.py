"""Archives whose bytes depend on nothing but what is in them; the licences and the icon among that."""

from __future__ import annotations

import hashlib
import os
import zipfile
from collections.abc import Callable, Mapping
from datetime import UTC, datetime
from importlib import metadata
from io import BytesIO
from pathlib import Path

from coupling.errors import BuildError
from coupling.files.atomic_file import AtomicFile, writing
from coupling.files.output_file import require_output

# Masters unpack with these permissions; a library must be readable and may be executable.
_FILE_MODE = 0o100644
_LIBRARY_MODE = 0o100755
# In the place of a GUID that is still to be computed.
_UNKNOWN = "{00000000-0000-0000-0000-000000000000}"
# zlib's fastest: a library takes a fifth of the time of zlib's default, and 7 % more room.
_COMPRESSION = 1
ICON = Path(__file__).parent / "model.png"


def write_fmu(
    file: Path,
    entries: Mapping[str, bytes],
    identified: Callable[[str], Mapping[str, bytes]],
    date: datetime,
) -> Path:
    """Write an FMU whose GUID is a hash of its content, and return the file.

    Args:
        file: File to write, ending in .fmu.
        entries: Content by path inside the archive, without what states the GUID.
        identified: Returns the entries that state the GUID.
        date: Date of every entry.

    Raises:
        BuildError: If the file cannot be written.
    """
    unknown = identified(_UNKNOWN)
    guid = content_guid({**entries, **unknown}).encode()
    stated = {name: data.replace(_UNKNOWN.encode(), guid) for name, data in unknown.items()}
    write_archive(file, ".fmu", {**entries, **stated}, date)
    return file


def write_archive(file: Path, suffix: str, entries: Mapping[str, bytes], date: datetime) -> None:
    """Write an archive; an existing file is replaced only when the new one is complete.

    Args:
        suffix: Ending that its name must have.
        entries: Content by path inside the archive.
        date: Date of every entry; times before 1980 are taken as 1980, as ZIP begins there.

    Raises:
        BuildError: If the file cannot be written.
    """
    require_output(file, suffix, BuildError)
    stamp = (max(date.year, 1980), *date.timetuple()[1:6])
    content = BytesIO()
    with zipfile.ZipFile(content, "w", zipfile.ZIP_DEFLATED) as archive:
        for name in sorted(entries):
            entry = zipfile.ZipInfo(name, stamp)
            entry.compress_type = zipfile.ZIP_DEFLATED
            entry.create_system = 3  # Unix, wherever it is written
            library = name.startswith("binaries/")
            entry.external_attr = (_LIBRARY_MODE if library else _FILE_MODE) << 16
            archive.writestr(entry, entries[name], compresslevel=_COMPRESSION)
    with writing(file, BuildError):
        file.parent.mkdir(parents=True, exist_ok=True)
        AtomicFile(file).write([content.getbuffer()])


def content_guid(entries: Mapping[str, bytes]) -> str:
    """Return a GUID that is a hash of names and contents.

    Example:
        >>> content_guid({"a": b"1"}) == content_guid({"a": b"1"}) != content_guid({"a": b"2"})
        True
    """
    digest = hashlib.sha256()
    for name in sorted(entries):
        for part in (name.encode(), entries[name]):
            digest.update(len(part).to_bytes(8, "big"))
            digest.update(part)
    h = digest.hexdigest()
    return f"{{{h[:8]}-{h[8:12]}-{h[12:16]}-{h[16:20]}-{h[20:32]}}}"


def build_date(*sources: Path) -> datetime:
    """Return the date to state in what is built: the same for the same input.

    SOURCE_DATE_EPOCH [s since 1970] where it is set (reproducible-builds.org), else the time at
    which the newest of the sources was written.

    Raises:
        BuildError: If SOURCE_DATE_EPOCH is not a time.
    """
    epoch = os.environ.get("SOURCE_DATE_EPOCH")
    if epoch is None:
        newest = max(f.stat().st_mtime for s in sources for f in s.rglob("*") if f.is_file())
        return datetime.fromtimestamp(int(newest), UTC)
    try:
        return datetime.fromtimestamp(int(epoch), UTC)
    except (ValueError, OverflowError, OSError) as cause:
        raise BuildError(
            f"SOURCE_DATE_EPOCH: expected a whole number of seconds since 1970, got {epoch!r}"
        ) from cause


def licenses(**distributions: str) -> dict[str, bytes]:
    """Return the licences of installed distributions as an FMU's content, by the names of the files.

    This project's own is always among them.
    """
    entries = {}
    for name, distribution in {"license": "elastic-robot-fmu", **distributions}.items():
        text = metadata.distribution(distribution).read_text("licenses/LICENSE")
        assert text is not None, distribution
        entries[f"documentation/licenses/{name}.txt"] = text.encode()
    return entries
