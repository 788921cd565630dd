"""The C core through ctypes: NumPy arrays in and out (see native/probe.c)."""

import ctypes
import functools
from pathlib import Path

import numpy as np
from places import TESTS

from coupling.native.compiler import compile_library, core_sources, host_platform
from coupling.native.robot_text import robot_text
from elastic_robot.description import Robot
from elastic_robot.settings import SETTINGS
from elastic_robot.torque_curves import TORQUE_CURVES

LANES = 4
# Wrench, anchor, its velocity, stiffness of its spring, contact.
LOAD_ENTRIES = 6 + 3 + 3 + 6 + 8
CURVES = tuple(TORQUE_CURVES)
# probe_curve: the branch that x itself lies on.
OWN_REGION = 2


@functools.cache
def library() -> ctypes.CDLL:
    probe = TESTS / "native" / "probe.c"
    file = compile_library(
        host_platform(), [probe, *core_sources()], ["-fvisibility=default", "-Wall", "-Wextra"]
    )
    lib = ctypes.CDLL(str(file))
    lib.probe_create.restype = ctypes.c_void_p
    lib.probe_failure.restype = ctypes.c_char_p
    lib.probe_next_kink.restype = ctypes.c_double
    lib.probe_newton.restype = ctypes.c_double
    lib.probe_contact.restype = ctypes.c_long
    for name in (
        "reset",
        "step",
        "outputs",
        "run",
        "drives",
        "read",
        "take_file",
        "uri",
        "watch_growth",
    ):
        getattr(lib, f"probe_{name}").restype = ctypes.c_bool
    return lib


def _load(values) -> ctypes.c_void_p:
    """A wrench, and as far as given anchor, its velocity, its spring's stiffness (xx .. zz), contact."""
    return _array(np.append(values, np.zeros(LOAD_ENTRIES - len(values))))


class CoreError(Exception):
    """The core's sentence."""


def read_data(file: Path) -> None:
    """Read an FMU's robot.txt, the robot and the variables, as an instance does."""
    if not library().probe_read(file.read_bytes()):
        raise CoreError(library().probe_failure().decode())


def folder_from_uri(uri: str, windows: bool) -> str | None:
    """The folder that a URI names; None if it names none."""
    folder = ctypes.create_string_buffer(200)
    return folder.value.decode() if library().probe_uri(uri.encode(), windows, folder) else None


def _array(values: np.ndarray | None) -> ctypes.c_void_p | None:
    if values is None:
        return None
    assert values.dtype == float
    assert values.flags.c_contiguous
    return values.ctypes.data_as(ctypes.c_void_p)


class Core:
    """A model of the core."""

    def __init__(self, robot: Robot | str, plain: bool = False) -> None:
        self._lib = library()
        text = robot if isinstance(robot, str) else robot_text(robot, "{test}")
        self._model = ctypes.c_void_p(self._lib.probe_create(text.encode()))
        self._require(bool(self._model))
        if plain:
            self._lib.probe_use_plain_kernel(self._model)

    def __del__(self) -> None:
        self._lib.probe_free(self._model)

    def _require(self, good: bool) -> None:
        if not good:
            raise CoreError(self._lib.probe_failure().decode())

    def chain(self, theta: np.ndarray, wrench: np.ndarray, m: int) -> dict[str, np.ndarray]:
        out = {
            "pose": np.zeros(7),
            "jacobian": np.zeros((6, len(theta))),
            "mass": np.zeros((m, m)),
            "torque": np.zeros(m),
            "gradient": np.zeros((m, m)),
        }
        arrays = [_array(values) for values in (theta, wrench, *out.values())]
        self._lib.probe_chain(self._model, *arrays)
        return out

    def loads(self, reference, theta, rate, acceleration, wrench, m: int) -> np.ndarray:
        """Of LANES states, (LANES, m); rows of the arguments are states."""
        load = np.zeros((m, LANES))
        lanes = [np.ascontiguousarray(values.T) for values in (theta, rate, acceleration)]
        arrays = [_array(values) for values in (reference, *lanes, wrench, load)]
        self._lib.probe_loads(self._model, *arrays)
        return load.T

    def pull(self, theta, wrench, m: int) -> tuple[np.ndarray, np.ndarray]:
        """TCP of LANES states, (LANES, 3), and what a wrench on it adds to their loads, (LANES, m)."""
        position, load = np.zeros((3, LANES)), np.zeros((m, LANES))
        lanes = [np.ascontiguousarray(values.T) for values in (theta, wrench)]
        self._lib.probe_pull(self._model, *map(_array, (*lanes, position, load)))
        return position.T, load.T

    def tangent(self, motion, wrench, directions, wrench_direction, m: int) -> np.ndarray:
        """Derivative of the loads of LANES states, (LANES, m); motion and directions: (3, LANES, n)."""
        load = np.zeros((m, LANES))
        lanes = [np.ascontiguousarray(values.T) for values in motion]
        along = np.ascontiguousarray(np.swapaxes(directions, 1, 2))
        arrays = [_array(values) for values in (*lanes, wrench, along, wrench_direction, load)]
        self._lib.probe_tangent(self._model, *arrays)
        return load.T

    def newton(self, matrices: np.ndarray, residual: np.ndarray) -> tuple[np.ndarray, float]:
        """One pass from rest by complex (2, m, m), residual (LANES, m): accelerations, their length."""
        m = residual.shape[1]
        acceleration, lanes = np.zeros((m, LANES)), np.ascontiguousarray(residual.T)
        parts = [np.ascontiguousarray(part) for part in (matrices.real, matrices.imag)]
        arrays = [_array(values) for values in (*parts, lanes, acceleration)]
        length = self._lib.probe_newton(self._model, m, *arrays)
        return acceleration.T, length

    def contact(self) -> tuple[np.ndarray, float, int]:
        """Wrench of the contact (6,), depth in its plane [m], tries of the last step."""
        wrench, depth = np.zeros(6), np.zeros(1)
        tries = self._lib.probe_contact(self._model, _array(wrench), _array(depth))
        return wrench, float(depth[0]), tries

    def columns(self, end, q, load, m: int, accuracy: float) -> tuple[np.ndarray, int]:
        """x and x' at the end of a step by the wrench, (6, 2 m), and passes; the step is taken back."""
        x, v = np.zeros((2, 6, m))
        values = ctypes.c_double(end), _array(np.array(q)), _load(load)
        accurate = ctypes.c_double(accuracy)
        passes = self._lib.probe_columns(self._model, *values, accurate, _array(x), _array(v))
        self._require(passes > 0)
        return np.hstack([x, v]), passes

    def curve(self, kind: str, x: np.ndarray, region: int = OWN_REGION) -> list[np.ndarray]:
        """Torque, slope and deflection of that torque at x (m, k)."""
        out = [np.zeros_like(x) for _ in range(3)]
        self._lib.probe_curve(
            self._model, CURVES.index(kind), region, x.shape[1], *map(_array, (x, *out))
        )
        return out

    def reset(
        self, curve, time, q, load, *, path="", quasistatic=False, tolerance=1e-6, undeflected=False
    ) -> None:
        self._require(
            self._lib.probe_reset(
                self._model,
                CURVES.index(curve),
                quasistatic,
                undeflected,
                ctypes.c_double(tolerance),
                str(path).encode(),
                ctypes.c_double(time),
                _array(np.array(q)),
                _load(load),
            )
        )

    def read(self, file: Path) -> None:
        """Take the motion of a file for the model's."""
        self._require(self._lib.probe_take_file(self._model, str(file).encode()))

    def step(self, end: float, q: np.ndarray, load: np.ndarray) -> None:
        done = self._lib.probe_step(
            self._model, ctypes.c_double(end), _array(np.array(q)), _load(load)
        )
        self._require(done)

    def watch_growth(self) -> bool:
        """Have the growth of a small shift watched from now on; whether one has grown beyond measure."""
        return self._lib.probe_watch_growth(self._model)

    def spring_of_matrices(self) -> np.ndarray:
        """Stiffness of the contact spring in the matrices of Newton's method: xx, xy, xz, yy, yz, zz."""
        stiffness = np.zeros(6)
        self._lib.probe_spring_of_matrices(self._model, _array(stiffness))
        return stiffness

    def outputs(self, m: int) -> dict[str, np.ndarray]:
        sizes = {
            "tcp": 7,
            "velocity": 6,
            "rigid": 7,
            "deviation": 6,
            "compliance": 6,
            "x": m,
            "torque": m,
        }
        out = {name: np.zeros(size) for name, size in sizes.items()}
        self._require(self._lib.probe_outputs(self._model, *map(_array, out.values())))
        return out

    def run(self, times: np.ndarray, m: int) -> np.ndarray:
        """Poses and deflections at times, (k, 7 + m), without a wrench."""
        rows = np.zeros((len(times), 7 + m))
        self._require(self._lib.probe_run(self._model, len(times), _array(times), _array(rows)))
        return rows

    def drives(self, times: np.ndarray, n: int) -> np.ndarray:
        """q, q', q'' of the trajectory at times, (3, k, n)."""
        motion = np.zeros((len(times), 3, n))
        done = self._lib.probe_drives(self._model, len(times), _array(times), _array(motion))
        self._require(done)
        return motion.swapaxes(0, 1)

    def next_kink(self, time: float, end: float, jump: float) -> float:
        values = [ctypes.c_double(value) for value in (time, end, jump)]
        return self._lib.probe_next_kink(self._model, *values)


def with_settings(robot: Robot, **values: float) -> Core:
    """The core with other numerical settings in its data."""
    text = robot_text(robot, "{x}")
    for name, value in values.items():
        line = f"setting {name} {float(getattr(SETTINGS, name))!r}"
        assert line in text
        text = text.replace(line, f"setting {name} {value!r}")
    return Core(text)
