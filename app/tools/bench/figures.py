# SPDX-License-Identifier: MIT
"""What is computed from the records of a run: pure functions (tests/tidy/test_bench.py)."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

Times = npt.NDArray[np.int64]
SHARES = (50.0, 99.0, 99.9, 100.0)


def percentiles(values: Times) -> list[int]:
    """p50, p99, p99.9 and the maximum: the smallest value that so many are not above."""
    ordered = np.sort(values)
    n = len(ordered)
    # Rounded: 99.9 * 1000 / 100 is a little more than 999.
    return [int(ordered[math.ceil(round(share * n / 100, 6)) - 1]) for share in SHARES] if n else []


def histogram_values(text: str) -> tuple[Times, int]:
    """Latencies in ns of cyclictest's histogram (-h, in us), and its maximum in ns."""
    rows = re.findall(r"^(\d{6}) (\d+)$", text, re.MULTILINE)
    found = re.search(r"^# Max Latencies: (\d+)", text, re.MULTILINE)
    if not rows or found is None:
        raise ValueError("no histogram")
    above = re.search(r"^# Histogram Overflows: 0*(\d+)", text, re.MULTILINE)
    values = [int(us) * 1000 for us, count in rows for _ in range(int(count))]
    most = int(found[1]) * 1000
    values += [most] * (int(above[1]) if above else 0)
    return np.array(values, dtype=np.int64), most


@dataclass
class Records:
    """The cycles of a run, as tests/bench/loops/loop.h has them."""

    wake_ns: Times
    late_ns: Times
    moved_ns: Times
    round_ns: Times
    has_answered: Times

    @staticmethod
    def read(path: Path) -> Records:
        return Records(*np.fromfile(path, dtype="<i8").reshape(-1, 5).T)

    @staticmethod
    def empty() -> Records:
        return Records(*np.zeros((5, 0), dtype=np.int64))

    @staticmethod
    def of_latency(late_ns: Times) -> Records:
        """Of a thread that only sleeps: nothing is sent, nothing can be lost."""
        zeros = np.zeros_like(late_ns)
        return Records(zeros + 1, late_ns, zeros, zeros, zeros)

    def lost(self, period_ns: int) -> npt.NDArray[np.bool_]:
        """The cycles without a complete answer before their end, which is the next deadline."""
        is_late = self.late_ns - self.moved_ns + self.round_ns > period_ns
        return (self.has_answered == 0) | is_late | (self.wake_ns == 0)

    def latency_ns(self) -> Times:
        return self.late_ns[self.wake_ns != 0]

    def interval_ns(self) -> Times:
        return np.diff(self.wake_ns[self.wake_ns != 0])

    def answered_ns(self, period_ns: int) -> Times:
        """Round trips of the cycles that are not lost."""
        return self.round_ns[~self.lost(period_ns)]


def runs(lost: npt.NDArray[np.bool_]) -> list[int]:
    """Lengths of the runs of lost cycles."""
    edges = np.flatnonzero(np.diff(np.concatenate(([0], lost.astype(np.int8), [0]))))
    return [int(n) for n in edges[1::2] - edges[::2]]


def mean(values: Sequence[float]) -> float | None:
    return sum(values) / len(values) if values else None


def ratio(ours: float | None, theirs: Iterable[float | None], more_is_better: bool) -> float | None:
    """How many times as good as the best of @theirs; None: nothing to compare."""
    known = [value for value in theirs if value is not None]
    if ours is None or not known:
        return None
    best = max(known) if more_is_better else min(known)
    above, below = (ours, best) if more_is_better else (best, ours)
    return above / below if below > 0 else None


def sync0_spread(text: bytes, since_ns: int, until_ns: int) -> tuple[int, int] | None:
    """Largest distance in ns between the SYNC0 edges of all slaves that belong together, over the
    time given (CLOCK_MONOTONIC) and in its last half; None without two slaves."""
    complete = text[: text.rfind(b"\n") + 1]
    numbers = np.array(complete.split(), dtype=np.int64).reshape(-1, 3)
    numbers = numbers[(numbers[:, 1] >= since_ns) & (numbers[:, 1] <= until_ns)]
    slaves = np.unique(numbers[:, 0])
    if len(slaves) < 2:
        return None
    times = [np.sort(numbers[numbers[:, 0] == slave, 1]) for slave in slaves]
    # The first and last ones may lack those that belong to them.
    first = times[0][1:-1]
    if len(first) == 0:
        return None
    low, high = first.copy(), first.copy()
    for other in times[1:]:
        after = np.clip(np.searchsorted(other, first), 1, len(other) - 1)
        is_before = first - other[after - 1] < other[after] - first
        nearest = np.where(is_before, other[after - 1], other[after])
        low, high = np.minimum(low, nearest), np.maximum(high, nearest)
    spread = high - low
    return int(spread.max()), int(spread[len(spread) // 2 :].max())


def strace_calls(text: str) -> int:
    """All calls in a table of `strace -c`."""
    found = re.search(
        r"^\s*100\.00(?:\s+[\d.]+){1,2}\s+(\d+)(?:\s+\d+)?\s+total$", text, re.MULTILINE
    )
    if found is None:
        raise ValueError(f"no table of strace -c: {text.strip()[-200:]}")
    return int(found[1])
