# SPDX-License-Identifier: MIT
"""ecdaq.align(): the samples of several appliances side by side, by UTC.

import ecdaq
both = ecdaq.align({"left": ecdaq.read("left"), "right": ecdaq.read("right")})
print(both)
frame = both.to_pandas()
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ecdaq import export
from ecdaq.clock import TIMEMAP, ClockAt
from ecdaq.recording import Recording
from ecdaq.table import Column, Gap, Table, blank

# A sample is that of a row if it is no further away than this share of its appliance's period.
NEAREST = 0.5
# In place of a distance.
NO_SAMPLE = np.iinfo(np.int64).min


@dataclass
class Aligned:
    """Rows are those of the first appliance, in the time that all of them have recorded.

    @table: channels as "APPLIANCE.CHANNEL"; where an appliance has no sample near a row, they are
    missing. Of each other appliance @distance_ns has the UTC of its sample minus that of the row,
    and @error_ns how far this difference can be off: the sum of what both time maps state of
    themselves (uncertainty_ns of /ecdaq/timemap) and of their hosts' clocks (clock_error_ns).
    @undisciplined: the appliances whose clocks nothing disciplines, for some rows at least; the
    error of these clocks is not known, and not in @error_ns.
    """

    table: Table
    distance_ns: dict[str, np.ndarray]
    error_ns: dict[str, np.ndarray]
    undisciplined: list[str]

    def __repr__(self) -> str:
        parts = [f"{len(self.table)} rows of {len(self.distance_ns) + 1} appliances"]
        for name, error in self.error_ns.items():
            near = np.abs(self.distance_ns[name][self.has(name)])
            parts.append(
                f"{name}: {len(near)} samples, at most {int(near.max(initial=0))} ns away, "
                f"+-{int(error.max(initial=0))} ns"
            )
        for name in self.undisciplined:
            parts.append(f"{name}: nothing disciplines its clock, whose error is not in these")
        return f"<ecdaq aligned: {'; '.join(parts)}>"

    def has(self, name: str) -> np.ndarray:
        """The rows to which the appliance @name has a sample, good or not."""
        return self.distance_ns[name] != NO_SAMPLE

    def to_pandas(self) -> Any:
        """As Recording.to_pandas(), with NAME.distance_ns and NAME.error_ns of each other one."""
        frame = export.to_pandas(self.table)
        for name, distance in self.distance_ns.items():
            frame[f"{name}.distance_ns"] = np.where(self.has(name), distance, np.nan)
            frame[f"{name}.error_ns"] = self.error_ns[name]
        frame.attrs["undisciplined"] = self.undisciplined
        return frame


def clock_at(recording: Recording, utc_ns: np.ndarray) -> ClockAt:
    return ClockAt(recording.topic(TIMEMAP), recording.files[0], utc_ns)


def nearest(times: np.ndarray, wanted: np.ndarray) -> np.ndarray:
    """The index of the nearest of @times, which ascend, to each of @wanted."""
    behind = np.clip(np.searchsorted(times, wanted), 1, max(1, len(times) - 1))
    before = behind - 1
    if len(times) == 1:
        return np.zeros(len(wanted), np.int64)
    return np.where(wanted - times[before] <= times[behind] - wanted, before, behind)


def recorded_rows(table: Table) -> np.ndarray:
    """Rows of cycles that were recorded: the others only show a gap."""
    keep = np.ones(len(table), bool)
    for gap in table.gaps:
        if gap.slave == "" and gap.count > 0:
            inside = (table.cycle >= gap.first_cycle) & (table.cycle < gap.first_cycle + gap.count)
            keep &= ~(inside & (table.session == gap.session))
    # Between two sessions there is one row that belongs to none.
    keep[np.flatnonzero(np.diff(table.session))] = False
    return keep


def by_time(table: Table) -> np.ndarray:
    """The recorded rows in ascending order of UTC, each instant once."""
    rows = np.flatnonzero(recorded_rows(table))
    _, first = np.unique(table.utc_ns[rows], return_index=True)
    return rows[first]


def taken(name: str, column: Column, rows: np.ndarray, has: np.ndarray) -> Column:
    return blank(
        Column(f"{name}.{column.name}", column.unit, column.values[rows], column.valid[rows] & has)
    )


def named(gap: Gap, appliance: str) -> Gap:
    return replace(gap, slave=f"{appliance}.{gap.slave}" if gap.slave else appliance)


def common_span(tables: Mapping[str, Table], order: Mapping[str, np.ndarray]) -> tuple[int, int]:
    """First and last UTC that all of them have."""
    for name, rows in order.items():
        if len(rows) == 0:
            raise ValueError(f"align: {name} has no samples in the selected time")
    low = max(int(t.utc_ns[order[name][0]]) for name, t in tables.items())
    high = min(int(t.utc_ns[order[name][-1]]) for name, t in tables.items())
    if low > high:
        raise ValueError(f"align: {', '.join(tables)} have no time in common")
    return low, high


def align(recordings: Mapping[str, Recording]) -> Aligned:
    """Bring the recordings of several appliances together by UTC, without interpolating: each row
    of the first one gets of every other one the sample that is nearest, at most half of that one's
    period away.

    ValueError: fewer than two, or they have no time in common. RecordingError: one has no time map.
    """
    if len(recordings) < 2:
        raise ValueError("align: two appliances or more, as {name: recording}")
    tables = {name: recording.table for name, recording in recordings.items()}
    order = {name: by_time(table) for name, table in tables.items()}
    low, high = common_span(tables, order)
    first, *others = recordings
    base = tables[first]
    rows = order[first][(base.utc_ns[order[first]] >= low) & (base.utc_ns[order[first]] <= high)]
    wanted = base.utc_ns[rows]
    clocks = {name: clock_at(recording, wanted) for name, recording in recordings.items()}
    own = clocks[first]
    has = np.ones(len(rows), bool)
    columns = [taken(first, c, rows, has) for c in base.columns.values()]
    distances: dict[str, np.ndarray] = {}
    errors: dict[str, np.ndarray] = {}
    for name in others:
        table = tables[name]
        times = table.utc_ns[order[name]]
        at = nearest(times, wanted)
        distance = times[at] - wanted
        period_ns = int(np.median(np.diff(times))) if len(times) > 1 else 0
        has = np.abs(distance) <= NEAREST * period_ns
        columns += [taken(name, c, order[name][at], has) for c in table.columns.values()]
        distances[name] = np.where(has, distance, NO_SAMPLE)
        errors[name] = sum(c.uncertainty_ns + c.error_ns for c in (own, clocks[name]))
    found = Table(
        base.session[rows], base.cycle[rows], wanted, base.dc_time_ns[rows],
        {c.name: c for c in columns},
        [named(gap, name) for name, table in tables.items() for gap in table.gaps],
    )  # fmt: skip
    undisciplined = [name for name, clock in clocks.items() if not clock.is_disciplined.all()]
    return Aligned(found, distances, errors, undisciplined)
