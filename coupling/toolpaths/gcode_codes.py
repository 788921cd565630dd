"""G- and M-words: which exclude each other, which change no path, and why others are not read."""

from __future__ import annotations

from collections.abc import Collection, Sequence

MOTIONS = (0.0, 1.0, 2.0, 3.0)
UNITS = {  # [m]
    **dict.fromkeys((20.0, 70.0, 700.0), 0.0254),
    **dict.fromkeys((21.0, 71.0, 710.0), 0.001),
}
# Returns to a reference point, probes of the bed, and moves in machine coordinates: where the tool is
# in the part is not known behind them.
RETURNS = {
    28.0: "a return to the machine's reference",
    29.0: "a return from the machine's reference, or a probe of the bed",
    30.0: "a return to the machine's reference",
    53.0: "a move in machine coordinates",
}
# The frame of the part; the program's coordinates are those of the part, whichever it is.
WORK_OFFSETS = {54.0, 55.0, 56.0, 57.0, 58.0, 59.0, 54.1, 59.1, 59.2, 59.3, 154.0} | {
    float(number) for number in (500, *range(505, 600))
}
# G-words that change nothing of a path of the tool's tip as such: stops and looks ahead, what ends
# compensations and cycles, cutting speeds; those with letters of their own below.
_BARE_IDLE_WORDS = """
9 40 43 49 50.1 61 61.1 62 67 69 80 92.1 92.2 96 97 98 99 450 451 601 602 603 641 642 643 644 645
"""
# All of them, and the letters that belong to them.
IDLE_G: dict[float, str] = {
    **dict.fromkeys(map(float, _BARE_IDLE_WORDS.split()), ""),
    5.1: "QPR",  # look-ahead; with coordinates a spline
    8.0: "P",  # look-ahead, or radii on a lathe
    15.0: "",  # polar coordinates off; with H a work offset of OKUMA's
    50.0: "",  # scaling off, or the spindle's limit; with coordinates a shift
    60.0: "",  # exact stop; with coordinates a positioning from one side
    64.0: "PQR",
    103.0: "P",
    187.0: "PE",
    **dict.fromkeys(sorted(WORK_OFFSETS), "P"),
}
# Words of which a line, and a control, takes one: its modal groups.
_GROUPS = (
    MOTIONS,
    (17.0, 18.0, 19.0),
    tuple(UNITS),
    (90.0, 91.0),
    (90.1, 91.1),
    (93.0, 94.0, 95.0),
    (40.0, 41.0, 42.0),
    (43.0, 43.4, 43.5, 49.0, 234.0),
    (61.0, 61.1, 64.0),
    (96.0, 97.0),
    (98.0, 99.0),
    tuple(sorted(WORK_OFFSETS)),
)
_CYCLE = "a cycle", "let the post-processor write its moves out"
_SHIFT = "a shift of the coordinates", "take it out, and give the part's frame where its origin is"
_TO_LINES = "post-process with lines and arcs"
_POCKET = "a circular pocket", "let the post-processor write its moves out"
_RADIUS = "cutter radius compensation", "compensate the radius in the CAM system"
_MACRO = "a call of a macro", "let the post-processor write its moves out"
_PROBING = "a probing move", "take it out"
_REFUSED: dict[float, tuple[str, str]] = {
    **dict.fromkeys((5.0, 5.2, 5.3, 6.2), ("a spline", _TO_LINES)),
    7.0: ("diameters of a lathe", "post-process for a mill"),
    10.0: ("an offset set by the program", "take it out, and give the part's frame where its origin is"),
    **dict.fromkeys((12.0, 13.0), _POCKET),
    16.0: ("polar coordinates", "post-process with X, Y, Z"),
    33.0: ("threading", "take it out"),
    **dict.fromkeys((41.0, 42.0), _RADIUS),
    43.1: ("a tool length of the program", "take it out: coordinates are those of the tool's tip"),
    51.0: ("scaling", "scale in the CAM system"),
    51.1: ("a mirror", "mirror in the CAM system"),
    **dict.fromkeys((52.0, 58.0, 59.0, 92.0, 92.3), _SHIFT),
    62.0: ("a mirror, or the speed in corners", "write G0 or G1 in its line"),
    **dict.fromkeys((65.0, 66.0), _MACRO),
    53.6: ("a turn of the tool to its plane about the tip", "use G53.1"),
    68.0: ("a rotation of the coordinates", "rotate in the CAM system, or the part's frame"),
    68.3: ("a tilted plane by the tool", "use G68.2 with Euler angles, and G53.1"),
    95.0: ("feed per revolution", "post-process with G94, feed per minute"),
    **dict.fromkeys((31.0, 38.2, 38.3, 38.4, 38.5), _PROBING),
    **dict.fromkeys((72.0, 73.0, 74.0, 75.0, 76.0, *(float(n) for n in range(81, 90))), _CYCLE),
}  # fmt: skip
# M-words that are more than a function of the machine: they change what is executed, or how.
_REFUSED_M: dict[float, tuple[str, str]] = {
    47.0: ("a repetition of the program", "take it out"),
    72.0: ("the return of stored modes", "write the modes"),
    89.0: ("a cycle at every point", "let the post-processor write its moves out"),
    91.0: ("machine coordinates", "take it out"),
    92.0: ("machine coordinates, or a printer's steps", "take it out"),
    **dict.fromkeys(
        (96.0, 97.0, 98.0),
        ("a call of a sub-program", "let the post-processor write its moves out"),
    ),
    99.0: ("a return to a calling program, or to the beginning", "end with M30"),
    206.0: ("an offset set by the program", "take it out"),
    220.0: ("an override of the feed", "write the feed that is meant"),
    428.0: (
        "an offset set by the program, or another kinematics",
        "take it out, and write coordinates in [tool_path.rotary]",
    ),
}
# Those of printers: temperatures, fans, limits, messages.  Their words are theirs alone.
_PRINTER_M = frozenset(
    float(number)
    for number in (
        *(17, 18, 20, 21, 22, 23, 24, 25, 26, 27, 73, 75, 76, 77, 82, 83, 84, 85),
        *range(104, 122), 126, 127, *range(140, 160), 190, 191, *range(200, 206), *range(207, 219), 221,
        226, 240, 250, 280,
        *range(300, 307), 355, *range(400, 408), 412, 413, 420, 486, *range(500, 505), 555,
        566, 569, 572, 575, 592, 593, 600, 601, 602, 603, 701, 702, 861, 862, 862.1,
        862.2, 862.3, 862.4, 862.5, 862.6, 863, 871, 900, 906, 907, 911, 913, 914, 915, 970, 991, 1002,
    )
)  # fmt: skip
# What they mean on mills of five axes, where the machine's axes are named.
_SHORTEST = "take it out, and name them in shortest of [tool_path.rotary]"
_OF_ROTARY_AXES = {
    114.0: ("another kinematics", "take it out, and write coordinates in [tool_path.rotary]"),
    116.0: ("a feed of rotary axes in millimetres", "take it out, and write feeds of the tip"),
    126.0: ("the shortest way of rotary axes", _SHORTEST),
}
# Heidenhain's words from which on X, Y, Z are the tool's tip in the part, and to which.
TIP_M = {128.0, 129.0}
# Words from which on they are, and those that end it; those of tilted planes.
TIP_ON, TIP_OFF = {43.4, 43.5, 234.0}, {43.0, 49.0}
PLANE_WORDS = {53.1, 68.2}
# Those with a limit, a place, a current or a gain for each axis, by its letter or by I, K.
_WORDS_OF_AXES = """
201 202 203 205 207 208 217 218 240 301 304 420 566 593 600 603 701 702 900 906 907 913 914 915 970
"""
_PRINTER_M_OF_AXES = frozenset(map(float, _WORDS_OF_AXES.split()))
_COORDINATES = frozenset("XYZIJK")
# Programmed shifts of SINUMERIK and NUM, and the mirror of OKUMA, which others have without coordinates.
_SHIFTS_BY_COORDINATES = frozenset((58.0, 59.0, 62.0))
# Letters of the M-words of mills: P, Q, L, E of outputs, inputs and stops.
PARAMETERS_OF_M = "PQLE"


def require_one_of_each(g: Sequence[float]) -> None:
    """Refuse a line with two G-words of one modal group.

    Raises:
        ValueError: If there are.
    """
    if len(g) < 2:
        return
    for group in _GROUPS:
        codes = list(dict.fromkeys(value for value in g if value in group))
        if len(codes) > 1:
            raise ValueError(
                f"expected one of G{codes[0]:g} and G{codes[1]:g} in a line, got both: write the one"
                " that is meant"
            )


def require_motion_word(g: Sequence[float], letters: Collection[str]) -> None:
    """Refuse coordinates beside a word that some controls take for a shift or a mirror by them.

    Raises:
        ValueError: If no word of the line says that they are a move.
    """
    for value in _SHIFTS_BY_COORDINATES.intersection(g):
        if not (_COORDINATES.isdisjoint(letters) or any(word in MOTIONS for word in g)):
            raise ValueError(refused_g(value))


def refused_g(value: float) -> str:
    """Return the sentence for a G-word that is not read."""
    name, remedy = _REFUSED.get(
        value, ("a word that is not known here", "take it out if nothing depends on it")
    )
    return f"expected no G{value:g}, got {name}: {remedy}"


def are_of_printers(m: Sequence[float], letters: Collection[str]) -> bool:
    """Return whether words without a G-word belong to a printer's M-word in their line.

    X, Y, Z, I, J, K are coordinates of a move but with a few: mills have functions by the same numbers.
    """
    if any(value in _PRINTER_M_OF_AXES for value in m):
        return True
    return any(value in _PRINTER_M for value in m) and _COORDINATES.isdisjoint(letters)


def require_functions(m: Sequence[float], is_of_five_axes: bool = False) -> None:
    """Refuse M-words that are more than a function of the machine: M0 to M99 are, but for a few.

    Args:
        m: Numbers of the words.
        is_of_five_axes: Whether the machine's rotary axes are named.

    Raises:
        ValueError: If there is such a word, or one that no standard knows.
    """
    refused = _REFUSED_M | _OF_ROTARY_AXES if is_of_five_axes else _REFUSED_M
    for value in m:
        if value in refused:
            name, remedy = refused[value]
            raise ValueError(f"expected no M{value:g}, got {name}: {remedy}")
        if not (value < 100.0 or value in TIP_M or value in _PRINTER_M):
            raise ValueError(
                f"expected functions of the machine M0 to M99, got M{value:g}: take it out if it moves"
                " nothing"
            )
