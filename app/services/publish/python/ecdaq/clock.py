# SPDX-License-Identifier: MIT
"""How well the time of a recording is known: what its time map states of itself and of the host's
clock."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ecdaq.errors import RecordingError
from ecdaq.messages import TIME, Columns

TIMEMAP = "/ecdaq/timemap"
NOT_KNOWN = -1


@dataclass(frozen=True)
class Clock:
    """The worst of the selected time.

    @uncertainty_ns: of UTC against the host's clock. @error_ns and @estimate_ns: of the host's
    clock against UTC, at most and probably, as chrony or linuxptp tell the kernel; None where, for
    some time at least, nothing disciplined it, or the recording does not state it.
    """

    uncertainty_ns: int
    error_ns: int | None
    estimate_ns: int | None
    tai_offset_s: int  # TAI minus UTC; 0: the kernel's was not set, CLOCK_TAI was taken for UTC
    steps: int  # of the host's clock

    @property
    def is_disciplined(self) -> bool:
        return self.error_ns is not None

    @property
    def total_ns(self) -> int | None:
        """How far the UTC of a sample is off at most."""
        return None if self.error_ns is None else self.uncertainty_ns + self.error_ns


def stated(messages: Columns, name: str) -> np.ndarray:
    """A column of the time map that recordings of earlier versions do not have."""
    count = len(messages[TIME])
    found = messages.get(name)
    if found is None:
        return np.full(count, NOT_KNOWN, np.int64)
    if found.dtype == object:  # some of the files have it
        return np.array([NOT_KNOWN if v is None else v for v in found], np.int64)
    return found


def worst(values: np.ndarray) -> int | None:
    return None if (values < 0).any() else int(values.max())


def require_map(messages: Columns, file: str) -> None:
    if len(messages[TIME]) == 0:
        raise RecordingError(file, "no time map in the selected time")


def clock_of(messages: Columns, file: str) -> Clock:
    require_map(messages, file)
    return Clock(
        int(messages["uncertainty_ns"].max()),
        worst(stated(messages, "clock_error_ns")),
        worst(stated(messages, "clock_estimate_ns")),
        int(messages["tai_offset_s"][-1]),
        int(messages["steps"].max()),
    )


class ClockAt:
    """What a time map states for each of some times: the larger one of the messages before and
    behind it."""

    def __init__(self, messages: Columns, file: str, utc_ns: np.ndarray) -> None:
        require_map(messages, file)
        at = messages[TIME].astype(np.int64)
        self._order = np.argsort(at, kind="stable")
        at = at[self._order]
        behind = np.searchsorted(at, utc_ns)
        self._before = np.clip(behind - 1, 0, len(at) - 1)
        self._behind = np.clip(behind, 0, len(at) - 1)
        error = stated(messages, "clock_error_ns")
        self.uncertainty_ns = self._larger(messages["uncertainty_ns"])
        self.is_disciplined = ~self._larger(error < 0)
        # Where nothing is known of the clock, it is not counted.
        self.error_ns = self._larger(np.maximum(error, 0))

    def _larger(self, values: np.ndarray) -> np.ndarray:
        values = values[self._order]
        return np.maximum(values[self._before], values[self._behind])
