"""What inputs do between two communication points: commands of the drives, ramps of the wrench."""

from __future__ import annotations

import fmpy


def test_drives_follow_commands(example_fmu, run_host):
    """Errors and their order against the trajectory, steps of any length, noise, jumps, states."""
    run_host("commanded", example_fmu)


def test_the_wrench_is_a_ramp_where_its_rate_is_told(example_fmu, run_host):
    """And derivatives that are none are refused, each with its sentence."""
    said = run_host("ramps", example_fmu)
    texts = {part.partition("\n")[0]: part for part in said.split("## ")}
    for name, expected in {
        "unknown": "value reference of a real variable: expected",
        "beyond": "value reference of a real variable: expected",
        "output": "derivative: expected that of an input, got tcp.x",
        "parameter": "derivative: expected that of an input, got gravity.z",
        "not a number": "derivative of force.y: expected a finite number, got nan",
        "order 2": "expected order 1, got 2",
        "order 0": "expected order 1, got 0",
    }.items():
        assert expected in texts[name], (name, texts)


def test_the_description_says_that_inputs_are_interpolated(example_fmu):
    assert fmpy.read_model_description(str(example_fmu)).coSimulation.canInterpolateInputs


def test_angles_that_jump_without_rates_are_said_in_the_log_once(example_fmu, run_host):
    run_host("rates", example_fmu)
