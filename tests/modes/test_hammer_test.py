"""A hammer test over time against the closed form of one mass on a spring."""

import numpy as np
import pytest

from coupling.errors import StabilityError
from coupling.modes.hammer_test import read_hammer_test

MASS, DAMPING, STIFFNESS = 2.0, 12.0, 2.0 * (2.0 * np.pi * 12.0) ** 2
STEP, LENGTH = 5e-4, 4.0


def _record(hits=2, step=STEP, length=LENGTH, noise=0.0, seed=0):
    """Return rows of time, hit, force and acceleration, the exact response to half a sine."""
    rng, rows = np.random.default_rng(seed), []
    time = step * np.arange(round(length / step))
    decay = DAMPING / (2.0 * MASS)
    omega = np.sqrt(STIFFNESS / MASS - decay**2)
    frequency = np.fft.rfftfreq(8 * len(time), step)
    s = 2j * np.pi * frequency
    for hit in range(1, hits + 1):
        force = np.where(time < 0.005, np.sin(np.pi * time / 0.005), 0.0) * 300.0 * hit
        spectrum = (
            np.fft.rfft(force, 8 * len(time)) * s**2 / (MASS * s**2 + DAMPING * s + STIFFNESS)
        )
        acceleration = np.fft.irfft(spectrum)[: len(time)] + noise * rng.normal(size=len(time))
        rows.append(np.column_stack([time, np.full(len(time), hit), force, acceleration]))
    assert omega > 0.0
    return np.vstack(rows)


def _write(file, rows, header="time_s,hit,fx_N,ax_m_s2"):
    np.savetxt(file, rows, delimiter=",", header=header, comments="")
    return file


@pytest.mark.parametrize(("noise", "tolerance"), [(0.0, 2e-3), (0.05, 0.05)])
def test_the_response_is_that_of_the_mass_on_its_spring(tmp_path, noise, tolerance):
    """1 / (k - m w^2 + i d w), from 3 periods of the record to 20 dB below the blow's spectrum."""
    (response,) = read_hammer_test(_write(tmp_path / "h.csv", _record(6, noise=noise)))
    omega = 2.0 * np.pi * response.frequency
    exact = 1.0 / (STIFFNESS - MASS * omega**2 + 1j * DAMPING * omega)
    assert response.name == "xx"
    assert response.frequency[0] == pytest.approx(4.0 / LENGTH)
    assert response.frequency[-1] > 150.0
    near = response.frequency > 4.0  # below it an accelerometer feels little
    assert np.median(np.abs(response.compliance / exact - 1.0)[near]) < tolerance


def test_several_directions_are_told_apart(tmp_path):
    """Hits along x and along y, each a little askew: H1 of all hits together."""
    rows = _record(2)
    first, second = rows[rows[:, 1] == 1], rows[rows[:, 1] == 2]
    a = np.column_stack([first[:, :3], 0.1 * first[:, 2], first[:, 3], 0.05 * first[:, 3]])
    b = np.column_stack([second[:, :2], 0.2 * second[:, 2], second[:, 2], 0.2 * second[:, 3],
                         0.5 * second[:, 3]])  # fmt: skip
    header = "time_s,hit,fx_N,fy_N,ax_m_s2,ay_m_s2"
    responses = read_hammer_test(_write(tmp_path / "h.csv", np.vstack([a, b]), header))
    by_name = {response.name: response for response in responses}
    omega = 2.0 * np.pi * by_name["xx"].frequency
    exact = 1.0 / (STIFFNESS - MASS * omega**2 + 1j * DAMPING * omega)
    near = omega > 2.0 * np.pi * 4.0
    assert np.max(np.abs(by_name["xx"].compliance / exact - 1.0)[near]) < 0.02
    assert np.max(np.abs(by_name["yy"].compliance / (0.5 * exact) - 1.0)[near]) < 0.02
    assert np.max(np.abs(by_name["xy"].compliance / exact)[near]) < 0.02


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda rows: rows[: len(rows) // 12], "died out"),
        (lambda rows: np.delete(rows, 5, axis=0), "equal steps"),
        (lambda rows: rows[:2], "equal steps"),
        (lambda rows: rows[:-40], "equal length"),
        (lambda rows: np.insert(rows, 3, 0.0, axis=1), "hit along each"),
    ],
)
def test_records_without_a_response_are_refused(tmp_path, change, words):
    """Cut off, with gaps, too short, of other lengths, without a blow."""
    rows = change(_record(2))
    header = "time_s,hit,fx_N,ax_m_s2" if rows.shape[1] == 4 else "time_s,hit,fx_N,fy_N,ax_m_s2"
    file = _write(tmp_path / "h.csv", rows, header)
    with pytest.raises(StabilityError, match=words):
        read_hammer_test(file)


@pytest.mark.parametrize("header", ["time_s,hit,force,ax_m_s2", "time_s,hit,fx_N,fy_N", "a,b,c,d"])
def test_columns_that_are_not_known_are_named(tmp_path, header):
    with pytest.raises(StabilityError, match="expected the columns time_s, hit"):
        read_hammer_test(_write(tmp_path / "h.csv", _record(1), header))
