# SPDX-License-Identifier: MIT
"""One channel over time, and the sine in it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from ecdaq.table import Column, Gap, Table

LEAST_SAMPLES = 8
STEPS = 30
# The frequency is known when a step changes the phase at the end by less than this, in rad.
SMALL_STEP = 1e-9


class Signal:
    """The samples of one channel; NaN where there is none, or none that is good."""

    def __init__(self, column: Column, table: Table) -> None:
        self.name = column.name
        self.unit = column.unit
        self.values: np.ndarray = column.as_float()
        self.exact = column.values  # integers as they are
        self.valid = column.valid
        self.utc_ns = table.utc_ns
        self.dc_time_ns = table.dc_time_ns
        self.cycle = table.cycle
        self.gaps: list[Gap] = table.gaps

    @property
    def seconds(self) -> np.ndarray:
        """UTC since the first sample."""
        return (self.utc_ns - self.utc_ns[0]) / 1e9 if len(self) else np.empty(0)

    def __len__(self) -> int:
        return len(self.values)

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> np.ndarray:
        return np.array(self.values, dtype=dtype)

    def __repr__(self) -> str:
        unit = f" [{self.unit}]" if self.unit else ""
        return f"<{self.name}{unit}: {len(self)} samples, {int(self.valid.sum())} good>"


@dataclass(frozen=True)
class SineFit:
    """offset + amplitude * sin(2 pi frequency_hz t + phase_rad), and what is left."""

    frequency_hz: float
    amplitude: float
    offset: float
    phase_rad: float  # at t = 0: the first sample of a Signal
    rms_residual: float
    snr_db: float  # power of the sine to that of the residual
    samples: int
    unit: str

    def __str__(self) -> str:
        unit = f" {self.unit}" if self.unit else ""
        return (
            f"{self.frequency_hz:.6g} Hz, amplitude {self.amplitude:.6g}{unit}, "
            f"offset {self.offset:.6g}{unit}, SNR {self.snr_db:.1f} dB ({self.samples} samples)"
        )


def fit_sine(values: Any, seconds: Any = None, *, unit: str = "") -> SineFit:
    """The sine that fits best: frequency, amplitude, offset and phase (IEEE 1057, four parameters).

    @values: a Signal of a recording; or an array, with @seconds of the same length. NaN is left
    out; samples may have gaps. The sine must have at least one period in the samples, and more than
    two samples a period. ValueError: too few samples, or no sine in them.
    """
    if isinstance(values, Signal):
        seconds, unit = (values.seconds if seconds is None else seconds), values.unit
    if seconds is None:
        raise ValueError("seconds: the times of the values are required")
    y, t = np.asarray(values, np.float64), np.asarray(seconds, np.float64)
    if y.shape != t.shape or y.ndim != 1:
        raise ValueError("values and seconds must be arrays of one dimension and equal length")
    good = np.isfinite(y) & np.isfinite(t)
    y, t = y[good], t[good]
    if len(y) < LEAST_SAMPLES or t[-1] <= t[0]:
        raise ValueError(f"{len(y)} good samples: at least {LEAST_SAMPLES} are needed")
    if y.max() == y.min():
        raise ValueError("all values are equal: no sine")
    return refine(y, t, coarse_frequency(y, t), unit)


def coarse_frequency(y: np.ndarray, t: np.ndarray) -> float:
    """The largest line of the spectrum, between its bins."""
    step = float(np.median(np.diff(t)))
    if not step > 0:
        raise ValueError("seconds must ascend")
    place = np.rint((t - t[0]) / step).astype(np.int64)
    if place[-1] >= 16 * len(y) + 1024:
        raise ValueError("more gaps than samples: select a part without them")
    even = np.zeros(int(place[-1]) + 1)
    window = np.hanning(len(even) + 2)[1:-1]
    even[place] = y - y.mean()
    spectrum = np.abs(np.fft.rfft(even * window))
    peak = int(spectrum[1:].argmax()) + 1
    delta = 0.0
    if 1 < peak < len(spectrum) - 1:
        left, top, right = (float(v) for v in spectrum[peak - 1 : peak + 2])
        # Of a Hann window: the ratio to the larger neighbour.
        side, sign = (right, 1) if right >= left else (left, -1)
        delta = sign * (2 * side - top) / (side + top) if side + top > 0 else 0.0
    return (peak + max(-0.5, min(0.5, delta))) / (len(even) * step)


def refine(y: np.ndarray, t: np.ndarray, frequency: float, unit: str) -> SineFit:
    """Gauss-Newton from a frequency nearby."""
    middle, span = (t[0] + t[-1]) / 2, t[-1] - t[0]
    at = t - middle
    omega = 2 * math.pi * frequency
    a = b = 0.0
    for _ in range(STEPS):
        cosine, sine = np.cos(omega * at), np.sin(omega * at)
        basis = [cosine, sine, np.ones_like(at)]
        if a or b:
            basis.append(at * (b * cosine - a * sine))
        matrix = np.column_stack(basis)
        # The normal equations: four unknowns, any number of samples.
        scale = np.sqrt((matrix * matrix).sum(axis=0))
        matrix /= scale
        solved = np.linalg.lstsq(matrix.T @ matrix, matrix.T @ y, rcond=None)[0] / scale
        a, b, offset = (float(v) for v in solved[:3])
        step = float(solved[3]) if len(solved) > 3 else math.inf
        if math.isfinite(step):
            omega += max(-math.pi / span, min(math.pi / span, step))
            if abs(step) * span < SMALL_STEP:
                break
    residual = y - (a * np.cos(omega * at) + b * np.sin(omega * at) + offset)
    amplitude, rms = math.hypot(a, b), float(np.sqrt(np.mean(residual * residual)))
    if omega <= 0 or not amplitude > 0 or omega * span < 2 * math.pi * 0.5:
        raise ValueError("no sine with a whole period in the samples")
    phase = math.atan2(a, b) - omega * middle
    snr = 20 * math.log10(amplitude / math.sqrt(2) / rms) if rms > 0 else math.inf
    return SineFit(
        omega / (2 * math.pi), amplitude, offset, math.remainder(phase, 2 * math.pi), rms, snr,
        len(y), unit,
    )  # fmt: skip
