"""What commands leave on robots with motors, servos, friction and hysteresis, for docs/inverse.md."""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from coupling.case.case import Case
from coupling.files.robot_file import find_robot
from coupling.path.deviation import Deviation, measure
from coupling.run.execute import Run
from docs.scripts.experiment import results, um
from docs.scripts.robots_with_backlash import FANUC_HOME, MIXED, kept, with_backlash
from docs.scripts.runs import compensated, example, replays

# At the gears' output, joint by joint: rotors [kg m^2], friction [N m] and, viscous, [N m s/rad], slip
# torques of the hysteresis [N m]; slip angles [rad].
ROTORS = (400.0, 400.0, 300.0, 40.0, 40.0, 30.0)
FRICTION = (300.0, 300.0, 200.0, 60.0, 50.0, 40.0)
SLIP = (120.0, 120.0, 90.0, 25.0, 20.0, 20.0)
ANGLES = (2e-5, 6e-5, 1.5e-4)
_SERVO = {"position_gain": 20.0, "rate_bandwidth_Hz": 30.0, "integral_time_s": 0.02}
_RATIO = 200.0
# What the commands are replayed on beside the run's own rows.
_WRONG = {"friction_factor": 1.2, "hysteresis_factor": 1.2}


def with_motors(file: Path) -> str:
    """Return the file of a robot with motors and hysteresis in its gears."""
    data = tomllib.loads(file.read_text(encoding="utf-8"))
    numbers = zip(data["joint"], ROTORS, FRICTION, SLIP, strict=True)
    for joint, rotor, friction, slip in numbers:
        if "stiffness" not in joint:
            continue
        elements = [{"slip_torque": slip / len(ANGLES), "slip_angle": angle} for angle in ANGLES]
        joint["gear"] = {"hysteresis": elements}
        joint["drive"] = {
            "rotor_inertia_kg_m2": rotor / _RATIO**2,
            "gear_ratio": _RATIO,
            "friction": {"coulomb_Nm": friction, "viscous_Nm_s": friction},
            "servo": _SERVO,
        }
    return str(kept(data, f"{file.stem}_motors"))


def _example(name: str, file: Path, **tables: Mapping[str, Any]) -> Callable[..., Case]:
    robot = {"description": with_motors(file), **tables.pop("robot", {})}

    def case(drive: str, plant: Mapping[str, Any]) -> Case:
        return example(name, robot=robot | {"drive": drive}, plant=plant, **tables)

    return case


def cases() -> dict[str, Callable[..., Case]]:
    """Return functions from drive and plant to cases, by title."""
    own = find_robot("icme2008")
    fanuc, abb = (
        Path(with_backlash(find_robot(name), MIXED)) for name in ("fanuc_r2000ic", "abb_irb7600")
    )
    iso = {"feed_m_s": 0.25, "sample_s": 0.004}
    return {
        "cone, 0.05 m/s": _example("cone", own, tool_path={"depth_m": 0.003}),
        "ISO 9283, 0.25 m/s": _example("iso9283", own, tool_path=iso),
        "ISO 9283, 1 m/s": _example("iso9283", own, tool_path=iso | {"feed_m_s": 1.0}),
        "slot, milled": _example("milling_20000", own),
        "cone, FANUC R-2000iC": _example(
            "cone",
            fanuc,
            robot={"home_deg": FANUC_HOME},
            part={"position_m": [1.6, 0.3, 0.6]},
            tool_path={"depth_m": 0.0015},
        ),
        "ISO 9283, 0.25 m/s, ABB IRB 7600": _example("iso9283", abb, tool_path=iso),
    }


def servos() -> str:
    """Return the table of what commands leave."""

    def corrected(case: Callable[..., Case]) -> tuple[Run, Run]:
        return compensated(case("ideal", {"drive": "servo"})), compensated(case("servo", _WRONG))

    def plant(run: Run) -> str:
        return _both(replays(run)["plant"])

    def worst(kind: str) -> Callable[[tuple[Run, Run]], str]:
        return lambda runs: um(
            max(d.maximum for name, d in replays(runs[1]).items() if name.startswith(kind)), 3
        )

    return results(
        ("max / rms [um]",),
        cases(),
        corrected,
        {
            "no correction": lambda runs: _both(measure(runs[1].before, runs[1].desired)),
            "command of ideal drives": lambda runs: plant(runs[0]),
            "command of its servos": lambda runs: _both(
                runs[1].correction.iterations[-1].deviation
            ),
            "friction 30 % wrong, max": worst("friction"),
            "gains 20 %": worst("servo gain"),
            "hysteresis 30 %": worst("hysteresis"),
            "backlash 20 %": worst("backlash"),
            "friction and hysteresis +20 %": lambda runs: plant(runs[1]),
        },
    )


def _both(found: Deviation) -> str:
    return f"{um(found.maximum, 3)} / {um(found.rms, 2)}"
