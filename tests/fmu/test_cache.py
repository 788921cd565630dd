"""Where libraries are kept: for users, and for services without a home folder."""

import os
from pathlib import Path

import pytest

from coupling.errors import BuildError
from coupling.native.cache import cache_folder, compiler_environment


@pytest.fixture
def temporary(tmp_path, monkeypatch):
    monkeypatch.delenv("XDG_CACHE_HOME", raising=False)
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    return tmp_path


def test_the_variable_names_the_folder(monkeypatch, tmp_path):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    assert cache_folder() == tmp_path / "elastic-robot"
    environment = compiler_environment()
    assert environment["ZIG_GLOBAL_CACHE_DIR"] == str(tmp_path / "elastic-robot" / "zig")


def test_a_named_folder_that_cannot_be_written_to_is_refused(monkeypatch, tmp_path):
    (tmp_path / "file").touch()
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "file"))
    with pytest.raises(BuildError, match="let the variable XDG_CACHE_HOME name another"):
        cache_folder()


def test_without_a_home_folder_it_is_the_users_own_among_temporary_files(temporary, monkeypatch):
    def homeless() -> Path:
        raise RuntimeError("Could not determine home directory.")

    monkeypatch.setattr(Path, "home", homeless)
    folder = cache_folder()
    assert folder.parent == temporary
    if os.name == "posix":
        assert folder.stat().st_mode & 0o077 == 0


@pytest.mark.skipif(os.name != "posix", reason="needs modes of POSIX")
def test_a_temporary_folder_that_others_can_write_to_is_not_trusted(temporary, monkeypatch):
    (temporary / "file").touch()
    monkeypatch.setattr(Path, "home", lambda: temporary / "file")
    cache_folder().chmod(0o777)
    with pytest.raises(BuildError, match="let the variable XDG_CACHE_HOME name one"):
        cache_folder()
