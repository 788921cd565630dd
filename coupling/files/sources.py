"""Sources of the numbers of a robot file: its table [sources].

A key of the table is the place of a number, such as joint[3].tilt[1].stiffness, or of many:
joint.tilt.stiffness is that of every tilt of every joint, joint[3] all that stands in joint 3.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import groupby
from typing import Any

from coupling.errors import one_of

_INDEX = re.compile(r"\[\d+\]")
SOURCES = "sources"
UNKNOWN = "the file does not say"


@dataclass(frozen=True)
class Number:
    """A number, or a vector, of a robot file.

    Attributes:
        place: Its place, joints and tilts counted from 1, as in joint[3].tilt[1].stiffness.
        source: Its source; "" where the file does not say.
    """

    place: str
    value: Any
    source: str


def numbers(data: Mapping[str, Any]) -> list[Number]:
    """Return all numbers of a robot file, in its order.

    Example:
        >>> file = {"joint": [{"axis": [0, 0, 1], "stiffness": 1e6}], "sources": {"joint": "a guess"}}
        >>> [(number.place, number.source) for number in numbers(file)]
        [('joint[1].axis', 'a guess'), ('joint[1].stiffness', 'a guess')]
    """
    sources = data.get(SOURCES, {})
    return [Number(place, value, _source(place, sources)) for place, value in places(data)]


def by_source(numbers: Sequence[Number]) -> dict[str, list[str]]:
    """Return the places of numbers by their source, those of all joints as one place.

    Example:
        >>> by_source([Number("joint[1].mass", 1.0, "a"), Number("joint[2].mass", 2.0, "a")])
        {'a': ['joint.mass']}
    """
    kinds: dict[str, set[str]] = {}
    for number in numbers:
        kinds.setdefault(kind(number.place), set()).add(number.source)
    names_by_source: dict[str, list[str]] = {}
    for number in numbers:
        whole = kind(number.place)
        place = whole if len(kinds[whole]) == 1 else number.place
        listed = names_by_source.setdefault(number.source or UNKNOWN, [])
        if place not in listed:
            listed.append(place)
    return names_by_source


def lost_places(data: Mapping[str, Any]) -> list[str]:
    """Return the keys of [sources] that are not the place of any number."""
    stated_places = [place for place, _ in places(data)]
    keys = data.get(SOURCES, {})
    return [key for key in keys if not any(_covers(key, place) for place in stated_places)]


def require_places(data: Mapping[str, Any]) -> None:
    """Refuse a key of [sources] that is not the place of any number."""
    for key in lost_places(data):
        stated_places = dict.fromkeys(_INDEX.sub("", place) for place, _ in places(data))
        raise ValueError(f"{SOURCES}: {one_of(stated_places, key, ' (with or without [number])')}")


def places(data: Mapping[str, Any], before: str = "") -> Iterator[tuple[str, Any]]:
    """Yield place and value of all that stands in the tables of a file, but for texts.

    Args:
        before: Place of `data` in it, with a dot behind.

    Example:
        >>> list(places({"tcp": {"position": [0.0, 0.0, 0.3]}, "joint": [{"mass": 20.0}]}))
        [('tcp.position', [0.0, 0.0, 0.3]), ('joint[1].mass', 20.0)]
    """
    for key, value in data.items():
        place = before + key
        if not before and key == SOURCES:
            continue
        if isinstance(value, Mapping):
            yield from places(value, f"{place}.")
        elif isinstance(value, list) and all(isinstance(v, Mapping) for v in value):
            for number, entry in enumerate(value, start=1):
                yield from places(entry, f"{place}[{number}].")
        elif not isinstance(value, str) or key == "file":
            yield place, value


def _source(place: str, sources: Mapping[str, str]) -> str:
    """Return the source of the key that says most about a place."""
    keys = [key for key in sources if _covers(key, place)]
    return sources[max(keys, key=_detail)] if keys else ""


def _covers(key: str, place: str) -> bool:
    """Return whether each part of a key is that of the place, with its number or without."""
    key_parts, whole = key.split("."), place.split(".")
    return len(key_parts) <= len(whole) and all(
        part in (at, _INDEX.sub("", at)) for part, at in zip(key_parts, whole, strict=False)
    )


def _detail(key: str) -> tuple[int, int]:
    return key.count("."), len(_INDEX.findall(key))


def kind(place: str) -> str:
    """Return a place without the numbers of joint and tilt.

    Example:
        >>> kind("joint[2].tilt[1].axis")
        'joint.tilt.axis'
    """
    parts = (list(part) for _, part in groupby(place, lambda letter: letter in "[]0123456789"))
    return "".join("".join(part) for part in parts if part[0] not in "[]")
