"""Where the FMU finds its resources: file: URIs of all systems, and folders of any length."""

from __future__ import annotations

import os

import numpy as np
import pytest
from native_core import folder_from_uri
from native_fmu import NativeFmu

from coupling.fmu_export.build import BuildOptions, build_fmu

# By a URI: the folder on Windows, and elsewhere.
URIS = {
    "file:///C:/a/b": ("C:/a/b", "/C:/a/b"),
    "file:/C:/a": ("C:/a", "/C:/a"),
    "file:C:/a": ("C:/a", "C:/a"),
    "file://C:/a/b": ("C:/a/b", "/a/b"),
    "file://C:\\a\\b": ("C:\\a\\b", ""),
    "file:///C%3A/a%20b": ("C:/a b", "/C:/a b"),
    "file://C%3a/a": ("C:/a", "/a"),
    "file://server/share/a": ("//server/share/a", "/share/a"),
    "file:////server/share/a": ("//server/share/a", "//server/share/a"),
    "file://localhost/C:/a": ("C:/a", "/C:/a"),
    "file:///home/%C3%A4%": ("/home/ä%", "/home/ä%"),
    "file://host/a": ("//host/a", "/a"),
    "file:": ("", ""),
    "file://": ("", ""),
    "file:/%": ("/%", "/%"),
    "http://C:/a": (None, None),
    "": (None, None),
}


@pytest.mark.parametrize("uri", URIS)
def test_a_uri_names_a_folder_as_each_system_writes_it(uri):
    """RFC 8089, its appendix on drives and shares, and what masters on Windows write."""
    assert (folder_from_uri(uri, True), folder_from_uri(uri, False)) == URIS[uri]


def test_resources_are_found_in_a_folder_of_any_length(example, tmp_path):
    """More than a thousand letters: a trajectory that is packed into the FMU is read there."""
    deep = tmp_path.joinpath(*["x" * 200] * 6)
    time = np.linspace(0.0, 1.0, 3)
    np.savetxt(
        tmp_path / "path.csv",
        np.column_stack([time, *[0.1 * time] * 6]),
        delimiter=",",
        header="time,q1,q2,q3,q4,q5,q6",
        comments="",
    )
    packed = {"path.csv": (tmp_path / "path.csv").read_bytes()}
    file = build_fmu(example, tmp_path / "R.fmu", BuildOptions("native"), packed)
    deep.mkdir(parents=True)
    fmu = NativeFmu(file, deep)
    assert len(os.fspath(deep)) > 1200
    slave = fmu.started(trajectory="path.csv")
    slave.doStep(0.0, 0.01)
    assert np.isfinite(fmu.get(slave, "tcp.x")[0])
