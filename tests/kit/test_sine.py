# SPDX-License-Identifier: MIT
"""fit_sine(): known sines are found, and what is none is refused."""

from __future__ import annotations

import math
from pathlib import Path

import ecdaq
import numpy as np
import pytest


def test_the_sine_of_a_recording_is_found(sample: Path) -> None:
    fit = ecdaq.fit_sine(ecdaq.read(sample)["piccolo1.adc"])
    assert fit.frequency_hz == pytest.approx(1, abs=1e-4)
    assert fit.amplitude == pytest.approx(0.5, abs=1e-3)
    assert fit.offset == pytest.approx(1, abs=1e-3)
    assert (fit.unit, fit.snr_db > 55) == ("V", True)
    assert "1 Hz, amplitude 0." in str(fit)


@pytest.mark.parametrize("periods", [1.2, 2.5, 10, 100.3, 400])
def test_frequency_amplitude_offset_phase_and_snr_are_found(periods: float) -> None:
    random = np.random.default_rng(int(periods * 10))
    t = np.arange(1000) * 1e-3 + 5
    frequency = periods / 1.0
    noise = 0.01 * random.standard_normal(len(t))
    y = 3 + 2 * np.sin(2 * np.pi * frequency * t + 0.7) + noise
    y[100:150] = np.nan
    fit = ecdaq.fit_sine(y, t, unit="A")
    assert fit.frequency_hz == pytest.approx(frequency, rel=3e-3 / periods)
    assert fit.amplitude == pytest.approx(2, rel=0.01)
    assert fit.offset == pytest.approx(3, rel=0.01)
    there = math.remainder(
        fit.phase_rad - 0.7 + 2 * np.pi * (fit.frequency_hz - frequency) * 5.5, 2 * np.pi
    )
    assert abs(there) < 0.01
    assert fit.snr_db == pytest.approx(20 * math.log10(math.sqrt(2) / 0.01), abs=1)
    assert fit.samples == 950


@pytest.mark.parametrize(
    ("values", "seconds", "reason"),
    [
        (np.ones(100), np.arange(100), "all values are equal"),
        (np.full(100, np.nan), np.arange(100), "0 good samples"),
        (np.arange(5.0), np.arange(5), "5 good samples"),
        (np.arange(50.0), None, "seconds"),
        (np.arange(50.0), np.arange(49), "equal length"),
        (np.arange(50.0) % 7, np.zeros(50), "good samples"),
    ],
)
def test_what_is_no_sine_is_refused(values: np.ndarray, seconds: np.ndarray, reason: str) -> None:
    with pytest.raises(ValueError, match=reason):
        ecdaq.fit_sine(values, seconds)
