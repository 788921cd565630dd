"""Table [place] of the case file: free settings, objective and constraints of `elastic-robot place`."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import AfterValidator, Field

from coupling.files.toml_file import Positive, Schema

Objective = Literal["stiffness", "backlash", "both", "stability"]


def _rises(ends: list[float]) -> list[float]:
    if ends[0] > ends[1]:
        raise ValueError(f"expected [low, high], low <= high, got {ends}")
    return ends


Range = Annotated[list[float], Field(min_length=2, max_length=2), AfterValidator(_rises)]
Share = Annotated[float, Field(ge=0.0, le=1.0)]


def _within(bound: float) -> AfterValidator:
    def check(ends: list[float]) -> list[float]:
        if max(abs(end) for end in ends) > bound:
            raise ValueError(f"expected angles between -{bound:g} and {bound:g} deg, got {ends}")
        return ends

    return AfterValidator(check)


class PlaceTable(Schema):
    """[place]: ranges of free settings, objective and constraints.

    Attributes:
        x_m, y_m, z_m: Part's position in the world; half a metre to both sides of where it is.
        yaw_deg: Part's yaw; all around.
        lead_deg, lean_deg: Tilt of the tool, as in [tool_path]; 30 deg from untilted to all sides where
            the process knows the tool's sphere, else as it is.
        rotation_deg: Rotation of the tool about its own axis; all around.
        base_roll_deg: First of base_rpy_deg; as it is.
        elbow_deg: Way of the home posture of a robot of more than six joints along its self-motion, the
            largest angle of a joint on it; 90 deg to both sides.
        optimise: "stiffness", least displacement of the tool by the process; "backlash", least error of
            the tool by backlashes 20 % off at gears that may reverse; "both", the sum; "stability",
            of the stiffest settings that whose milling cut is farthest from chatter.
        joint_margin_deg: Smallest distance from the joints' limits.
        least_conditioning: Smallest conditioning of the Jacobian, 1 / |J^-1|.
        clear_share: A gear keeps its flank where its torque stays clear of zero by this part of the
            range that it passes through along the path.
        settings, seed: Number of sampled settings, seed of the sample.
        cases: Number of the best settings that become case files.
    """

    x_m: Range | None = None
    y_m: Range | None = None
    z_m: Range | None = None
    yaw_deg: Annotated[Range, _within(360.0)] = [-180.0, 180.0]
    lead_deg: Annotated[Range, _within(89.0)] | None = None
    lean_deg: Annotated[Range, _within(89.0)] | None = None
    rotation_deg: Annotated[Range, _within(360.0)] = [-180.0, 180.0]
    base_roll_deg: Annotated[Range, _within(180.0)] | None = None
    elbow_deg: Annotated[Range, _within(180.0)] | None = None
    optimise: Objective = "both"
    joint_margin_deg: Annotated[float, Field(ge=0.0)] = 5.0
    least_conditioning: Positive = 0.03
    clear_share: Share = 0.25
    settings: Annotated[int, Field(ge=100, le=10_000_000)] = 100_000
    seed: Annotated[int, Field(ge=0)] = 1
    cases: Annotated[int, Field(ge=1, le=20)] = 3
