# SPDX-License-Identifier: MIT
"""Samples of all slaves in rows, one for each cycle; gaps are rows as well, without values."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

# A longer gap has two rows: its first and its last cycle. So has every gap if all of them together
# have more cycles than were recorded, and this many.
GAP_ROWS = 100_000


@dataclass(frozen=True)
class Gap:
    """Cycles that were not recorded."""

    session: int
    slave: str  # "": all
    first_cycle: int
    count: int  # 0: a new session begins, how much is missing is not known
    start_utc_ns: int  # of the samples before and behind it
    end_utc_ns: int


@dataclass(frozen=True)
class Column:
    """The values of one channel. Where @valid is not set, floats are NaN and the rest is 0."""

    name: str
    unit: str
    values: np.ndarray
    valid: np.ndarray

    def as_float(self) -> np.ndarray:
        """float64, NaN where there is no good sample."""
        if self.values.dtype == np.float64:
            return self.values
        found = self.values.astype(np.float64)
        found[~self.valid] = np.nan
        return found


@dataclass
class Table:
    """Rows in the order of recording; arrays of equal length."""

    session: np.ndarray
    cycle: np.ndarray
    utc_ns: np.ndarray
    dc_time_ns: np.ndarray
    columns: dict[str, Column]
    gaps: list[Gap]

    def __len__(self) -> int:
        return len(self.cycle)


@dataclass
class SlaveSamples:
    """What one session has of one slave; cycles ascend."""

    slave: str
    cycle: np.ndarray
    utc_ns: np.ndarray
    dc_time_ns: np.ndarray
    good: np.ndarray
    values: dict[str, np.ndarray]

    def sorted(self) -> SlaveSamples:
        """Each cycle once, in ascending order."""
        if (np.diff(self.cycle) > 0).all():
            return self
        _, first = np.unique(self.cycle, return_index=True)
        return SlaveSamples(
            self.slave, self.cycle[first], self.utc_ns[first], self.dc_time_ns[first],
            self.good[first], {name: v[first] for name, v in self.values.items()},
        )  # fmt: skip


@dataclass(frozen=True)
class Limits:
    """First and last value that is selected of a column of the table."""

    column: str  # cycle, utc_ns or dc_time_ns
    first: int
    last: int


def missing(cycles: np.ndarray, grid: np.ndarray) -> list[tuple[int, int]]:
    """First and count of the cycles from grid's first to its last that are not in @cycles."""
    if len(cycles) == 0:
        return [(int(grid[0]), int(grid[-1] - grid[0]) + 1)]
    found = []
    if cycles[0] > grid[0]:
        found.append((int(grid[0]), int(cycles[0] - grid[0])))
    steps = np.diff(cycles)
    for n in np.flatnonzero(steps > 1):
        found.append((int(cycles[n]) + 1, int(steps[n]) - 1))
    if cycles[-1] < grid[-1]:
        found.append((int(cycles[-1]) + 1, int(grid[-1] - cycles[-1])))
    return found


class SessionRows:
    """The rows of one session."""

    def __init__(self, session: int, slaves: list[SlaveSamples]) -> None:
        self.session = session
        self.slaves = [slave.sorted() for slave in slaves]
        self._make_grid()
        self._fill()
        self.gaps = self._find_gaps()

    def _make_grid(self) -> None:
        """The cycles that any slave has, and the times of each."""
        fullest = max(self.slaves, key=lambda s: len(s.cycle))
        self.cycle, self.utc_ns, self.dc_time_ns = (
            fullest.cycle, fullest.utc_ns, fullest.dc_time_ns
        )  # fmt: skip
        if all(np.array_equal(s.cycle, self.cycle) for s in self.slaves):
            return
        self.cycle = np.unique(np.concatenate([s.cycle for s in self.slaves]))
        self.utc_ns = np.empty(len(self.cycle), np.int64)
        self.dc_time_ns = np.empty(len(self.cycle), np.int64)
        for s in self.slaves:
            at = np.searchsorted(self.cycle, s.cycle)
            self.utc_ns[at], self.dc_time_ns[at] = s.utc_ns, s.dc_time_ns

    def _fill(self) -> None:
        """Rows for cycles that no slave has; @place: where the recorded ones are among them."""
        self.recorded = self.cycle
        self.place: np.ndarray | None = None
        steps = np.diff(self.cycle)
        if len(steps) == 0 or steps.max() == 1:
            return
        fills = np.where(steps - 1 <= GAP_ROWS, steps - 1, 2)
        if fills.sum() > len(self.cycle) + GAP_ROWS:
            fills = np.minimum(steps - 1, 2)
        counts = np.append(fills + 1, 1)
        starts = np.concatenate(([0], np.cumsum(counts)[:-1]))
        row = np.repeat(np.arange(len(counts)), counts)  # the recorded one before each
        within = np.arange(len(row)) - starts[row]
        steps = np.append(steps, 1)
        is_full = counts[row] == steps[row]
        within = np.where(is_full | (within < 2), within, steps[row] - 1)
        following = np.minimum(row + 1, len(counts) - 1)
        part = within / steps[row]

        def between(times: np.ndarray) -> np.ndarray:
            return times[row] + np.rint((times[following] - times[row]) * part).astype(np.int64)

        self.place = starts
        self.utc_ns, self.dc_time_ns = between(self.utc_ns), between(self.dc_time_ns)
        self.cycle = self.cycle[row] + within

    def _find_gaps(self) -> list[Gap]:
        lists = {s.slave: missing(s.cycle, self.recorded) for s in self.slaves}
        common = set.intersection(*(set(found) for found in lists.values()))
        named = [("", *span) for span in common]
        named += [(s, *span) for s, found in lists.items() for span in found if span not in common]
        found = []
        for slave, first, count in sorted(named, key=lambda gap: gap[1:]):
            before = max(0, int(np.searchsorted(self.cycle, first)) - 1)
            behind = min(len(self.cycle) - 1, int(np.searchsorted(self.cycle, first + count)))
            start, end = int(self.utc_ns[before]), int(self.utc_ns[behind])
            found.append(Gap(self.session, slave, first, count, start, end))
        return found

    def column(self, name: str, unit: str) -> Column:
        """The values of a channel in the rows."""
        count = len(self.cycle)
        for s in self.slaves:
            if name not in s.values:
                continue
            if len(s.cycle) == count:
                values, valid = s.values[name], s.good
            else:
                rows = np.searchsorted(self.recorded, s.cycle)
                rows = rows if self.place is None else self.place[rows]
                values = np.zeros(count, s.values[name].dtype)
                valid = np.zeros(count, bool)
                values[rows], valid[rows] = s.values[name], s.good
            return blank(Column(name, unit, values, valid))
        return blank(Column(name, unit, np.zeros(count, bool), np.zeros(count, bool)))


def blank(column: Column) -> Column:
    """No value where none is valid."""
    if not column.valid.all():
        column.values[~column.valid] = np.nan if column.values.dtype.kind == "f" else 0
    return column


def end_of_session(rows: SessionRows, following: SessionRows) -> Gap:
    return Gap(
        following.session, "", int(following.cycle[0]), 0, int(rows.utc_ns[-1]),
        int(following.utc_ns[0]),
    )  # fmt: skip


def one_more(values: np.ndarray) -> np.ndarray:
    """@values, and one as far behind the last as that is behind the one before."""
    step = values[-1] - values[-2] if len(values) > 1 else 1
    return np.append(values, values[-1] + step)


def build(sessions: list[SessionRows], units: dict[str, str]) -> Table:
    """All sessions. Between two of them there is a row without values, so that no line of a plot
    joins them."""
    gaps: list[Gap] = []
    arrays: dict[str, list[np.ndarray]] = {
        "session": [],
        "cycle": [],
        "utc_ns": [],
        "dc_time_ns": [],
    }
    parts: dict[str, list[Column]] = {name: [] for name in units}
    for n, rows in enumerate(sessions):
        is_last = n == len(sessions) - 1
        gaps += rows.gaps
        for name in ("cycle", "utc_ns", "dc_time_ns"):
            values = getattr(rows, name)
            arrays[name].append(values if is_last else one_more(values))
        arrays["session"].append(np.full(len(arrays["cycle"][-1]), rows.session, np.int64))
        for name, unit in units.items():
            column = rows.column(name, unit)
            parts[name].append(column if is_last else with_blank(column))
        if not is_last:
            gaps.append(end_of_session(rows, sessions[n + 1]))
    joined = {name: concatenate(found) for name, found in arrays.items()}
    columns = {
        name: Column(
            name, units[name], join_values(found), concatenate([c.valid for c in found])
        )
        for name, found in parts.items()
    }  # fmt: skip
    return Table(**joined, columns=columns, gaps=gaps)


def concatenate(parts: list[np.ndarray]) -> np.ndarray:
    if len(parts) == 1:
        return parts[0]
    return np.concatenate(parts) if parts else np.empty(0, np.int64)


def with_blank(column: Column) -> Column:
    values = np.append(column.values, np.zeros(1, column.values.dtype))
    return blank(replace(column, values=values, valid=np.append(column.valid, False)))


def join_values(found: list[Column]) -> np.ndarray:
    """The values of a channel of all sessions; of those that have it, if that is not all."""
    known = {c.values.dtype for c in found if c.valid.any()}
    kind = np.result_type(*known) if known else found[0].values.dtype if found else np.dtype(float)
    parts = [c.values.astype(kind, copy=False) for c in found]
    if kind.kind == "f":
        parts = [
            p if c.valid.all() else np.where(c.valid, p, np.nan)
            for c, p in zip(found, parts, strict=True)
        ]
    return concatenate(parts)


def clip(table: Table, limits: list[Limits]) -> Table:
    """The rows within all @limits, and the gaps that are in them at least in part."""
    keep = np.ones(len(table), bool)
    for limit in limits:
        values = getattr(table, limit.column)
        keep &= (values >= limit.first) & (values <= limit.last)
    if keep.all():
        return table
    columns = {
        name: replace(c, values=c.values[keep], valid=c.valid[keep])
        for name, c in table.columns.items()
    }
    bounds = {int(n): cycle_bounds(table, int(n), limits) for n in np.unique(table.session)}
    gaps = []
    for gap in table.gaps:
        low, high = bounds[gap.session]
        first = max(gap.first_cycle, low)
        last = min(gap.first_cycle + max(1, gap.count) - 1, high)
        if first <= last:
            gaps.append(replace(gap, first_cycle=first, count=gap.count and last - first + 1))
    return Table(
        table.session[keep], table.cycle[keep], table.utc_ns[keep], table.dc_time_ns[keep],
        columns, gaps,
    )  # fmt: skip


def cycle_bounds(table: Table, session: int, limits: list[Limits]) -> tuple[int, int]:
    """First and last cycle of @session within all @limits; the rows of a gap may be few."""
    rows = np.flatnonzero(table.session == session)
    cycles = table.cycle[rows]
    low, high = int(cycles[0]), int(cycles[-1])
    for limit in limits:
        if limit.column == "cycle":
            low, high = max(low, limit.first), min(high, limit.last)
            continue
        times = getattr(table, limit.column)[rows]
        origin, end = int(times[0]), int(times[-1])
        if limit.first > end or limit.last < origin:
            return 1, 0
        after = [
            float(np.interp(float(t - origin), times - origin, cycles - cycles[0]))
            for t in (limit.first, limit.last)
        ]
        low = max(low, int(cycles[0]) + math.ceil(after[0]))
        high = min(high, int(cycles[0]) + math.floor(after[1]))
    return low, high
