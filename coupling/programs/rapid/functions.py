"""Functions of RAPID: those that are computed, and those whose value only the controller knows."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping

from coupling.errors import ProgramError
from coupling.programs.poses import inverse, pose_of_zyx, product, zyx_of_pose
from coupling.programs.program import Pose
from coupling.programs.rapid.values import (
    Data,
    Value,
    format_value,
    numbers_of,
    pose_of,
    value_of,
)
from coupling.programs.unknown import Unknown

Options = Mapping[str, Value]
_Function = Callable[[list[Value], Options, str], tuple[str, Value]]
_ORIGIN: Value = (0.0, 0.0, 0.0)

# What these return depends on the robot, its signals, its operator, files, or the time.
_CONTROLLER_WORDS = """
AInput AOutput ArgName BitAnd BitCheck BitLSh BitNeg BitOr BitRSh BitXOr ByteToStr CalcJointT
CalcRobT CalcRotAxFrameZ CalcRotAxisFrame CDate CJointT ClkRead CorrRead CPos CRobT CSpeedOverride
CTime CTool CWObj DecToHex DefAccFrame DefDFrame DefFrame DInput DnumToStr DOutput EventType
ExecHandler ExecLevel FileSize FileTime FSSize GetMecUnitName GetModalPayLoadMode GetServiceInfo
GetSignalOrigin GetSysInfo GetTaskName GetTime GetTSPStatus GInput GInputDnum GOutput GOutputDnum
HexToDec IndInpos IndSpeed IOUnitState IsCyclicBool IsFile IsMechUnitActive IsPers IsStopMoveAct
IsStopStateEvent IsSyncMoveOn IsSysId IsVar MaxRobReach MaxRobSpeed MirPos ModExist ModTime
MotionPlannerNo NumToStr ORobT ParIdPosValid ParIdRobValid PathLevel PathRecValidBwd
PathRecValidFwd PFRestart PPMovedInManMode ProgMemFree RawBytesLen ReadBin ReadMotor ReadNum
ReadStr ReadStrBin ReadVar RMQGetSlotName RobName SocketGetStatus SocketPeek StrDigCalc StrDigCmp
StrFind StrFormat StrLen StrMap StrMatch StrMemb StrOrder StrPart StrToByte TaskIsActive
TaskIsExecuting TaskRunMec TaskRunRob TasksInSync TestDI TestSignRead TextGet TextTabFreeToUse
TextTabGet TriggDataValid Type UIAlphaEntry UIClientExist UIDnumEntry UIDnumTune UIListView
UIMessageBox UINumEntry UINumTune ValidIO ValToStr
"""
# These change data that they are given.
_WRITING_WORDS = "GetNextMechUnit GetNextSym ReadDir StrToVal TestAndSet"
WRITING = frozenset(word.upper() for word in _WRITING_WORDS.split())
# Options of functions and instructions in which they return something.
RETURNING = frozenset(["TIMEFLAG", "VALUEATTIMEOUT", "ERRORNUMBER", "BREAKFLAG", "RESULT"])
_CONTROLLER = {word.upper(): word for word in f"{_CONTROLLER_WORDS} {_WRITING_WORDS}".split()}


def is_known(name: str) -> bool:
    """Return whether RAPID has a function of this name."""
    return name.upper() in _COMPUTED_FUNCTIONS or name.upper() in _CONTROLLER


def call_function(name: str, arguments: list[Value], options: Options, where: str) -> Data:
    """Return the value of a function of RAPID.

    Args:
        name: Its name; `is_known`.
        arguments: Values that stand in their places.
        options: Values behind backslashes, by name in capitals.
        where: Place in the program, for messages.

    Raises:
        ProgramError: If it has no value of these arguments.

    Example:
        >>> call_function("Sqrt", [16.0], {}, "here").value
        4.0
    """
    compute = _COMPUTED_FUNCTIONS.get(name.upper())
    if compute is None:
        return Data("", Unknown(f"{_CONTROLLER[name.upper()]}, which the controller evaluates"))
    for value in (*arguments, *options.values()):
        if (unknown := _unknown_in(value)) is not None:
            return Data("", unknown)
    try:
        kind, result = compute(arguments, options, where)
    except (ValueError, OverflowError, ZeroDivisionError) as cause:
        got = ", ".join(format_value(value) for value in arguments[:4])
        raise ProgramError(f"{where}: expected arguments of {name}, got {got}") from cause
    return Data(kind, result)


def _unknown_in(value: Value) -> Unknown | None:
    if isinstance(value, Unknown):
        return value
    if isinstance(value, tuple):
        return next((unknown for item in value if (unknown := _unknown_in(item))), None)
    return None


def _numbers(arguments: list[Value], count: int, where: str) -> list[float]:
    if len(arguments) != count:
        raise ValueError("arguments")
    return numbers_of(tuple(arguments), "argument", where)


def _scalar(function: Callable[[float], float]) -> _Function:
    def compute(arguments: list[Value], options: Options, where: str) -> tuple[str, Value]:
        (x,) = _numbers(arguments, 1, where)
        return "num", function(x)

    return compute


def _to_decimals(half: float) -> _Function:
    """Return the function that adds a half, or nothing, and cuts to decimals, towards zero."""

    def compute(arguments: list[Value], options: Options, where: str) -> tuple[str, Value]:
        (x,) = _numbers(arguments, 1, where)
        (decimals,) = numbers_of(options.get("DEC", 0.0), "decimals", where)
        scale = 10.0 ** min(max(int(decimals), 0), 15)
        return "num", math.copysign(math.floor(abs(x) * scale + half) / scale, x)

    return compute


def _pair(function: Callable[[float, float], float]) -> _Function:
    def compute(arguments: list[Value], options: Options, where: str) -> tuple[str, Value]:
        return "num", float(function(*_numbers(arguments, 2, where)))

    return compute


def _parts(target: Value, count: int) -> tuple[Value, ...]:
    if not isinstance(target, tuple) or len(target) != count:
        raise ValueError("target")
    return target


def _vector(value: Value, where: str) -> list[float]:
    numbers = numbers_of(value, "position", where)
    if len(numbers) != 3:
        raise ValueError("position")
    return numbers


def _offs(arguments: list[Value], options: Options, where: str) -> tuple[str, Value]:
    position, *offsets = _parts(arguments[0] if arguments else "", 4)
    offset = _numbers(arguments[1:], 3, where)
    place = _vector(position, where)
    return "robtarget", (tuple(p + d for p, d in zip(place, offset, strict=True)), *offsets)


def _rel_tool(arguments: list[Value], options: Options, where: str) -> tuple[str, Value]:
    """Shift along the tool's axes, then turn about its x, its new y, its new z."""
    position, rotation, *further_arguments = _parts(arguments[0] if arguments else "", 4)
    unknown = set(options) - {"RX", "RY", "RZ"}
    if unknown:
        raise ProgramError(f"{where}: expected \\Rx, \\Ry, \\Rz of RelTool, got \\{unknown.pop()}")
    pose = product(
        pose_of((position, rotation), where),
        pose_of_zyx(_numbers(arguments[1:], 3, where), (0.0, 0.0, 0.0)),
    )
    for option, at in (("RX", 2), ("RY", 1), ("RZ", 0)):
        angles = [0.0, 0.0, 0.0]
        (angles[at],) = numbers_of(options.get(option, 0.0), "angle", where)
        pose = product(pose, pose_of_zyx((0.0, 0.0, 0.0), angles))
    placed = value_of(pose)
    assert isinstance(placed, tuple)
    return "robtarget", (*placed, *further_arguments)


def _orient_zyx(arguments: list[Value], options: Options, where: str) -> tuple[str, Value]:
    pose = pose_of_zyx((0.0, 0.0, 0.0), _numbers(arguments, 3, where))
    return "orient", _rotation(pose)


def _rotation(pose: Pose) -> Value:
    x, y, z, w = pose[3:]
    return (w, x, y, z)


def _euler_zyx(arguments: list[Value], options: Options, where: str) -> tuple[str, Value]:
    (rotation,) = arguments
    z, y, x = zyx_of_pose(pose_of((_ORIGIN, rotation), where))
    angles = {"X": x, "Y": y, "Z": z}
    if len(options) != 1 or not set(options) <= set(angles):
        raise ValueError("axis")
    return "num", angles[next(iter(options))]


def _pose_mult(arguments: list[Value], options: Options, where: str) -> tuple[str, Value]:
    first, second = (pose_of(value, where) for value in arguments)
    return "pose", value_of(product(first, second))


def _pose_inv(arguments: list[Value], options: Options, where: str) -> tuple[str, Value]:
    (pose,) = arguments
    return "pose", value_of(inverse(pose_of(pose, where)))


def _pose_vect(arguments: list[Value], options: Options, where: str) -> tuple[str, Value]:
    pose, place = arguments
    shift = pose_of_zyx(_vector(place, where), (0.0, 0.0, 0.0))
    placed = value_of(product(pose_of(pose, where), shift))
    assert isinstance(placed, tuple)
    return "pos", placed[0]


def _vect_magn(arguments: list[Value], options: Options, where: str) -> tuple[str, Value]:
    (vector,) = arguments
    return "num", math.hypot(*_vector(vector, where))


def _dot_prod(arguments: list[Value], options: Options, where: str) -> tuple[str, Value]:
    first, second = (_vector(value, where) for value in arguments)
    return "num", sum(a * b for a, b in zip(first, second, strict=True))


def _cross_prod(arguments: list[Value], options: Options, where: str) -> tuple[str, Value]:
    (a, b, c), (d, e, f) = (_vector(value, where) for value in arguments)
    return "pos", (b * f - c * e, c * d - a * f, a * e - b * d)


def _n_orient(arguments: list[Value], options: Options, where: str) -> tuple[str, Value]:
    (rotation,) = arguments
    numbers = numbers_of(rotation, "quaternion", where)
    length = math.hypot(*numbers)
    if len(numbers) != 4:
        raise ValueError("quaternion")
    return "orient", tuple(number / length for number in numbers)


def _distance(arguments: list[Value], options: Options, where: str) -> tuple[str, Value]:
    first, second = (_vector(value, where) for value in arguments)
    return "num", math.dist(first, second)


_COMPUTED_FUNCTIONS: dict[str, _Function] = {
    "ABS": _scalar(abs),
    "SQRT": _scalar(math.sqrt),
    "EXP": _scalar(math.exp),
    "SIN": _scalar(lambda x: math.sin(math.radians(x))),
    "COS": _scalar(lambda x: math.cos(math.radians(x))),
    "TAN": _scalar(lambda x: math.tan(math.radians(x))),
    "ASIN": _scalar(lambda x: math.degrees(math.asin(x))),
    "ACOS": _scalar(lambda x: math.degrees(math.acos(x))),
    "ATAN": _scalar(lambda x: math.degrees(math.atan(x))),
    "ATAN2": _pair(lambda y, x: math.degrees(math.atan2(y, x))),
    "POW": _pair(math.pow),
    "MAX": _pair(max),
    "MIN": _pair(min),
    "NUMTODNUM": _scalar(float),
    "DNUMTONUM": _scalar(float),
    "ROUND": _to_decimals(0.5),
    "TRUNC": _to_decimals(0.0),
    "VECTMAGN": _vect_magn,
    "DOTPROD": _dot_prod,
    "CROSSPROD": _cross_prod,
    "NORIENT": _n_orient,
    "POSEVECT": _pose_vect,
    "OFFS": _offs,
    "RELTOOL": _rel_tool,
    "ORIENTZYX": _orient_zyx,
    "EULERZYX": _euler_zyx,
    "POSEMULT": _pose_mult,
    "POSEINV": _pose_inv,
    "DISTANCE": _distance,
    # What a program asks so as to do something else at a desk, or by hand.
    "ROBOS": lambda *_: ("bool", True),
    "NONMOTIONMODE": lambda *_: ("bool", False),
    "OPMODE": lambda *_: ("num", 1.0),
    "RUNMODE": lambda *_: ("num", 1.0),
}
# What is assumed by a computed function, a sentence each.
ASSUMED = {
    "ROBOS": "it runs on a robot (RobOS is TRUE)",
    "NONMOTIONMODE": "it runs with motion (NonMotionMode is FALSE)",
    "OPMODE": "it runs in automatic operation (OpMode is OP_AUTO)",
    "RUNMODE": "it runs continuously (RunMode is RUN_CONT_CYCLE)",
}
# Names of the operation and running modes.
MODES = {
    **{"OP_UNDEF": 0.0, "OP_AUTO": 1.0, "OP_MAN_PROG": 2.0, "OP_MAN_TEST": 3.0},
    **{"RUN_UNDEF": 0.0, "RUN_CONT_CYCLE": 1.0, "RUN_INSTR_FWD": 2.0, "RUN_INSTR_BWD": 3.0},
    **{"RUN_SIM": 4.0, "RUN_STEP_MOVE": 5.0},
}
