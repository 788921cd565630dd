"""Building native FMUs: what is refused, and the cache of compiled libraries."""

from __future__ import annotations

import pytest

from build_fmu import main
from coupling.errors import BuildError
from coupling.fmu_export.build import BuildOptions, build_fmu
from coupling.native.compiler import PLATFORMS, CompilerError, compile_library, host_platform


def test_unknown_kinds_and_platforms_are_refused(example, tmp_path, capsys):
    assert main(["-o", str(tmp_path / "R.fmu"), "--kind", "native", "--platforms", "vax"]) == 2
    said = capsys.readouterr().err
    assert "platform: expected one of linux64, win64" in said
    assert "got 'vax'" in said
    assert main(["-o", str(tmp_path / "R.fmu"), "--kind", "python", "--platforms", "darwin64"]) == 2
    assert "PythonFMU has libraries for, linux64, win64, got 'darwin64'" in capsys.readouterr().err
    assert main(["-o", str(tmp_path / "R.fmu"), "--kind", "python", "--sources"]) == 2
    assert "leave out --kind python" in capsys.readouterr().err
    with pytest.raises(BuildError, match="kind: expected one of native, python, got 'java'"):
        build_fmu(example, tmp_path / "R.fmu", BuildOptions("java"))
    assert not list(tmp_path.iterdir())


def test_fmi3_is_for_native_fmus(example, tmp_path, capsys):
    assert main(["-o", str(tmp_path / "R.fmu"), "--kind", "python", "--fmi", "3"]) == 2
    assert "leave out --kind python" in capsys.readouterr().err
    with pytest.raises(BuildError, match="FMI version: expected one of 2, 3, got '1'"):
        build_fmu(example, tmp_path / "R.fmu", BuildOptions("native", fmi="1"))
    assert not list(tmp_path.iterdir())


def test_libraries_are_compiled_once(tmp_path):
    """The cache's key follows sources and flags."""
    source = tmp_path / "one.c"
    source.write_text("int one(void) { return 1; }")
    first = compile_library(host_platform(), [source], cache=tmp_path / "cache")
    stamp = first.stat().st_mtime_ns
    assert compile_library(host_platform(), [source], cache=tmp_path / "cache") == first
    assert first.stat().st_mtime_ns == stamp
    other = compile_library(host_platform(), [source], ["-DX"], cache=tmp_path / "cache")
    source.write_text("int one(void) { return 2; }")
    changed = compile_library(host_platform(), [source], cache=tmp_path / "cache")
    assert len({first, other, changed}) == 3
    source.write_text("not C")
    with pytest.raises(CompilerError, match=r"failed for"):
        compile_library(host_platform(), [source], cache=tmp_path / "cache")


def test_without_a_compiler_the_need_is_told(monkeypatch):
    monkeypatch.setattr("coupling.native.compiler.zig", lambda: None)
    other = next(p for p in PLATFORMS.values() if p != host_platform())
    with pytest.raises(CompilerError, match=r"install the package ziglang .* or cc, gcc or clang"):
        compile_library(other, [])
