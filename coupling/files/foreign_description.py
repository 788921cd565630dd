"""Robots as others describe them: URDF, xacro, MJCF, and the names of robot_descriptions."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

from coupling.files.extras import extra
from coupling.files.mjcf import read_mjcf
from coupling.files.urdf_elements import parse_xml
from elastic_robot.errors import RobotFileError

# Names such as panda_description and ur5e_mj_description.
_NAME = re.compile(r"[a-z][a-z0-9_]*_description")


@dataclass(frozen=True)
class ForeignRobot:
    """A robot as others describe it.

    Attributes:
        file: The URDF as it stands; None where it had to be made.
        remarks: Sentences on what could not be written into it.
    """

    name: str
    file: Path | None
    text: str
    source: str
    remarks: tuple[str, ...] = ()


def is_foreign(name_or_path: str) -> bool:
    """Return whether a robot is described by other files than ours."""
    return Path(name_or_path).suffix.lower() not in ("", ".toml") or _is_name(name_or_path)


def _is_name(text: str) -> bool:
    return _NAME.fullmatch(text) is not None


def foreign_robot(name_or_path: str) -> ForeignRobot:
    """Return a robot of a URDF, xacro or MJCF file, or of a name of robot_descriptions.

    Raises:
        RobotFileError: If it cannot be found, read or converted, or a package is missing for that.
    """
    path = Path(name_or_path)
    if _is_name(name_or_path):
        return _of_descriptions(name_or_path)
    if not path.is_file():
        raise RobotFileError(f"{path}: no such file")
    if path.suffix.lower() == ".xacro":
        return _of_xacro(path)
    tag = "robot" if path.suffix.lower() == ".urdf" else _root_tag(path)
    if tag == "mujocoinclude":
        raise RobotFileError(f"{path}: is a part of an MJCF file: give the file that includes it")
    if tag != "mujoco":
        return ForeignRobot(path.stem, path, "", f"URDF {path.name}")
    urdf, remarks = read_mjcf(path)
    return ForeignRobot(path.stem, None, urdf, f"MJCF {path.name}", remarks)


def _root_tag(path: Path) -> str:
    try:
        return parse_xml(path.read_bytes()).tag
    except (OSError, ValueError) as cause:
        raise RobotFileError(f"{path}: expected a URDF or MJCF file: {cause}") from cause


def _of_xacro(path: Path) -> ForeignRobot:
    xacrodoc = extra("xacrodoc", "xacro", "a xacro file")
    # A package's neighbours, which are of the same repository, are found without an installation.
    packages = [folder for folder in path.resolve().parents if (folder / "package.xml").is_file()]
    try:
        if packages:
            extra("xacrodoc.packages", "xacro", "a xacro file").look_in([packages[0].parent])
        text = xacrodoc.XacroDoc.from_file(str(path)).to_urdf_string()
    except Exception as cause:  # whatever xacro and the expressions in the file may raise
        reason = " ".join(str(cause).split())
        raise RobotFileError(
            f"{path}: xacro cannot convert it: {type(cause).__name__}: {reason[:300]}: where it needs"
            " arguments or other packages, convert it with them, by xacro, and give the URDF"
        ) from cause
    name = path.name.removesuffix(".xacro").removesuffix(".urdf")
    return ForeignRobot(name, None, text, f"xacro {path.name}")


def _of_descriptions(name: str) -> ForeignRobot:
    descriptions = extra(
        "robot_descriptions", "descriptions", f"{name}, a name of robot_descriptions,"
    )
    if name not in descriptions.DESCRIPTIONS:
        raise RobotFileError(
            f"{name}: expected a name of robot_descriptions, got another: its list is"
            " robot_descriptions list"
        )
    try:
        module = extra(f"robot_descriptions.{name}", "descriptions", name)
    except RobotFileError:
        raise
    except Exception as cause:  # it is downloaded by git
        reason = " ".join(str(cause).split())
        raise RobotFileError(
            f"{name}: robot_descriptions cannot download it: {type(cause).__name__}: {reason[:300]}"
        ) from cause
    for attribute in ("URDF_PATH", "XACRO_PATH", "MJCF_PATH"):
        if hasattr(module, attribute):
            described = foreign_robot(str(getattr(module, attribute)))
            return ForeignRobot(
                name.removesuffix("_description"),
                described.file,
                described.text,
                f"{described.source} of robot_descriptions, {name}",
                described.remarks,
            )
    raise RobotFileError(f"{name}: expected a URDF or MJCF, got neither")
