"""Bags of ROS 1 and 2 and MCAP: poses of one topic."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from coupling.errors import reason_of
from coupling.files.extras import extra
from coupling.files.recorded_table import RecordedTable
from elastic_robot.errors import ElasticRobotError

ENDINGS = (".bag", ".mcap", ".db3")
# Letters of a reader's reason at most: some have a whole definition.
_REASON = 200
# Where a message has its position and its orientation, by its type.
_PLACES = {
    "geometry_msgs/msg/PoseStamped": ("pose.position", "pose.orientation"),
    "geometry_msgs/msg/PointStamped": ("point", ""),
    "geometry_msgs/msg/TransformStamped": ("transform.translation", "transform.rotation"),
    "geometry_msgs/msg/PoseWithCovarianceStamped": ("pose.pose.position", "pose.pose.orientation"),
    "nav_msgs/msg/Odometry": ("pose.pose.position", "pose.pose.orientation"),
}


def is_bag(path: Path) -> bool:
    """Return whether a file or folder is a bag."""
    return path.suffix in ENDINGS or (path / "metadata.yaml").is_file()


def read_recorded_bag(path: Path, topic: str | None, error: type[Exception]) -> RecordedTable:
    """Read the poses of a topic; times are those of its messages' headers.

    Args:
        topic: Its topic; None where one topic alone has poses.
        error: Exception class for every problem.
    """
    try:
        highlevel, typesys = (
            extra(f"rosbags.{name}", "bags", "a bag of ROS") for name in ("highlevel", "typesys")
        )
    except ElasticRobotError as cause:
        raise error(f"{path}: {cause}") from cause
    store = typesys.get_typestore(typesys.Stores.LATEST)
    try:
        with highlevel.AnyReader([path], default_typestore=store) as reader:
            connections = _connections(path, reader, topic, error)
            rows = [
                _row(reader.deserialize(raw, connection.msgtype), connection.msgtype)
                for connection, _, raw in reader.messages(connections=connections)
            ]
            others = sorted({c.topic for c in reader.connections} - {connections[0].topic})
    except error:
        raise
    except Exception as cause:
        # A damaged bag fails in many ways in its readers.
        reason = " ".join(reason_of(cause).split())[:_REASON]
        raise error(
            f"{path}: is no whole bag of ROS, or its messages are not known: {reason}"
        ) from cause
    if not rows:
        raise error(f"{path}: expected messages of {connections[0].topic}, got none")
    nanoseconds = np.array([row[0] for row in rows], dtype=np.int64)
    values = np.array([row[1:] for row in rows])
    names = ("x", "y", "z", "qx", "qy", "qz", "qw")[: values.shape[1]]
    columns = {"time": 1e-9 * (nanoseconds - nanoseconds[0])}
    columns |= dict(zip(names, values.T, strict=True))
    left_out = (f"the topics {', '.join(others)}",) if others else ()
    units = {"time": "s", **dict.fromkeys("xyz", "m")}
    return RecordedTable(path, columns, units, left_out)


def _connections(path: Path, reader: Any, topic: str | None, error: type[Exception]) -> list[Any]:
    """Return the connections of a topic with poses."""
    able = [c for c in reader.connections if c.msgtype in _PLACES]
    topics = sorted({connection.topic for connection in able})
    if topic is None and len(topics) == 1:
        topic = topics[0]
    if not topics:
        kinds = ", ".join(kind.rpartition("/")[2] for kind in _PLACES)
        others = sorted({f"{c.topic} ({c.msgtype.rpartition('/')[2]})" for c in reader.connections})
        raise error(
            f"{path}: expected a topic of measured poses, a {kinds}, got"
            f" {', '.join(others) or 'no topic'}: record or convert one of these"
        )
    if topic not in topics:
        stated = "" if topic is None else f", got {topic}"
        raise error(
            f"{path}: expected one topic of poses{stated}; those of the bag: {', '.join(topics)}: name"
            " it with --columns topic=/NAME"
        )
    return [connection for connection in able if connection.topic == topic]


def _row(message: Any, kind: str) -> list[float]:
    """Return time [ns], position and orientation of a message."""
    position, orientation = (_at(message, place) for place in _PLACES[kind])
    stamp = message.header.stamp
    row = [stamp.sec * 1_000_000_000 + stamp.nanosec, position.x, position.y, position.z]
    if orientation is not None:
        row += [orientation.x, orientation.y, orientation.z, orientation.w]
    return row


def _at(message: Any, place: str) -> Any:
    if not place:
        return None
    for name in place.split("."):
        message = getattr(message, name)
    return message
