# SPDX-License-Identifier: MIT
"""ecdaq.read(): recordings as numpy arrays, DataFrames, files of other formats.

import ecdaq
recording = ecdaq.read("build/run/record")
print(recording)
frame = recording.to_pandas()
"""

from __future__ import annotations

import datetime
import fnmatch
import itertools
import os
from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import cached_property
from typing import Any

import numpy as np

from ecdaq import export
from ecdaq.clock import TIMEMAP, Clock, clock_of
from ecdaq.container import Chunk, Room
from ecdaq.errors import RecordingError
from ecdaq.messages import COMMON, TIME, Channel, Columns, Joined, RecordedFile, Task, join, run
from ecdaq.sine import Signal
from ecdaq.sources import find
from ecdaq.table import Column, Gap, Limits, SessionRows, SlaveSamples, Table, build, clip

Where = str | os.PathLike[str]
Instant = int | str | datetime.datetime | np.datetime64
Names = str | Iterable[str] | None
LAST = 2**63 - 1


def read(
    source: Where | Sequence[Where],
    channels: Names = None,
    *,
    slaves: Names = None,
    utc: tuple[Instant | None, Instant | None] | None = None,
    cycles: tuple[int | None, int | None] | None = None,
    dc_ns: tuple[int | None, int | None] | None = None,
    raw: bool = False,
) -> Recording:
    """The recording in a file, a folder, an http(s) URL, or a list of these.

    Nothing but the names of the files is read before values are asked for, and then only what is
    selected. @channels: names or patterns like "piccolo*.adc"; @slaves: names or patterns; default:
    all. @utc, @cycles, @dc_ns: the first and the last that is included, None: open. An instant of
    UTC is ns since 1970, an ISO 8601 text, a datetime or a datetime64; without a zone it is UTC.
    @raw: as in the process image, not scaled, and of samples that are not good as well.

    RecordingError: a file is damaged, cut off, or not of ecdaq. ValueError: no such channel.
    """
    where = [source] if isinstance(source, str | os.PathLike) else list(source)
    files = [RecordedFile(found) for one in where for found in find(one)]
    limits = []
    for column, span, convert in (
        ("utc_ns", utc, utc_ns), ("cycle", cycles, int), ("dc_time_ns", dc_ns, int)
    ):  # fmt: skip
        if span is not None:
            low, high = (None if end is None else convert(end) for end in span)
            limits.append(
                Limits(column, -LAST if low is None else low, LAST if high is None else high)
            )
    return Recording(files, patterns(channels), patterns(slaves), limits, raw)


def patterns(names: Names) -> list[str] | None:
    return None if names is None else [names] if isinstance(names, str) else list(names)


def utc_ns(when: Instant) -> int:
    """ns since 1970."""
    if isinstance(when, int | np.integer):
        return int(when)
    if isinstance(when, str):
        when = np.datetime64(when.removesuffix("Z")) if "+" not in when[10:] else (
            datetime.datetime.fromisoformat(when)
        )  # fmt: skip
    if isinstance(when, datetime.datetime):
        if hasattr(when, "as_unit"):  # of pandas, with ns
            return int(when.as_unit("ns").value)
        zoned = when if when.tzinfo else when.replace(tzinfo=datetime.UTC)
        since = zoned - datetime.datetime(1970, 1, 1, tzinfo=datetime.UTC)
        return (since.days * 86400 + since.seconds) * 10**9 + since.microseconds * 1000
    if np.isnat(when):
        raise ValueError("utc: not a time")
    return int(when.astype("datetime64[ns]").astype(np.int64))


class Recording:
    """One or many files of samples. Values are read when they are asked for."""

    def __init__(
        self,
        files: list[RecordedFile],
        channels: list[str] | None,
        slaves: list[str] | None,
        limits: list[Limits],
        raw: bool,
    ) -> None:
        self._files = files
        self._wanted = channels
        self._slaves = slaves
        self._limits = limits
        self._raw = raw

    def __repr__(self) -> str:
        names = ", ".join(f"{c.name} [{c.unit}]" if c.unit else c.name for c in self.channels)
        return f"<ecdaq recording: {len(self._files)} files; {names}>"

    # What there is

    @property
    def files(self) -> list[str]:
        return [file.name for file in self._files]

    @cached_property
    def channels(self) -> list[Channel]:
        """The selected channels of all files."""
        found: dict[str, tuple[Channel, str]] = {}
        for file in self._files:
            for channel in file.channels:
                before, first = found.setdefault(channel.name, (channel, file.name))
                if before.unit != channel.unit and not self._raw:
                    raise RecordingError(
                        file.name,
                        f"{channel.name} is in '{channel.unit}' here and in '{before.unit}' in "
                        f"{first}: read them one by one",
                    )
        known = [channel for channel, _ in found.values()]
        if self._slaves is not None:
            require(self._slaves, [c.slave for c in known], "slave")
            known = [c for c in known if any_match(c.slave, self._slaves)]
        if self._wanted is None:
            return known
        require(self._wanted, [c.name for c in known], "channel")
        return [c for c in known if any_match(c.name, self._wanted)]

    @property
    def units(self) -> dict[str, str]:
        return {c.name: "" if self._raw else c.unit for c in self.channels}

    @cached_property
    def gaps(self) -> list[Gap]:
        """What was not recorded, between the first and the last sample that are selected."""
        return self.table.gaps

    def select(self, channels: Names = None, slaves: Names = None) -> Recording:
        """The same with fewer channels, by names or patterns."""
        chosen = self.channels
        if slaves is not None:
            require(patterns(slaves) or [], [c.slave for c in chosen], "slave")
            chosen = [c for c in chosen if any_match(c.slave, patterns(slaves) or [])]
        if channels is not None:
            require(patterns(channels) or [], [c.name for c in chosen], "channel")
            chosen = [c for c in chosen if any_match(c.name, patterns(channels) or [])]
        names = [fnmatch_escape(c.name) for c in chosen]
        return Recording(self._files, names, None, self._limits, self._raw)

    def newest(self) -> Recording:
        """Only the newest session of the master."""
        newest = [f for f in self._files if f.session == self._files[-1].session]
        return Recording(newest, self._wanted, self._slaves, self._limits, self._raw)

    # Values

    @cached_property
    def table(self) -> Table:
        """All that is selected, in rows of one cycle each."""
        return self._load()

    def __getitem__(self, name: str) -> Signal:
        """The samples of one channel."""
        if "table" in self.__dict__:
            table = self.table
            require([fnmatch_escape(name)], list(table.columns), "channel")
        else:
            table = self.select(fnmatch_escape(name)).table
        column: Column = table.columns[name]
        return Signal(column, table)

    def topic(self, name: str) -> Columns:
        """All messages of a topic, /ecdaq/event say: a column for each field, and log_time_ns.

        Of the selected time in UTC; values as they are in the file.
        """
        tasks: list[Task] = []
        for file in self._files:
            if (topic := file.topics.get(name)) is not None:
                chunks = [c for c in file.chunks if self._may_have(file, c)]
                tasks += [(file, batch, {topic.id: None}) for batch in file.batches(chunks)]
        if not tasks and not any(name in file.topics for file in self._files):
            known = dict.fromkeys(topic for file in self._files for topic in file.topics)
            raise ValueError(f"no topic {name}: there are: {' '.join(known)}")
        parts = [p for found in run(tasks) for columns in found.values() for p in columns]
        if not parts:
            return {TIME: np.empty(0, np.uint64)}
        found = join(parts)
        keep = np.ones(len(found[TIME]), bool)
        for limit in self._limits:
            if limit.column == "utc_ns":
                first, last = max(0, limit.first), max(0, limit.last)
                keep &= (found[TIME] >= first) & (found[TIME] <= last)
        return {column: values[keep] for column, values in found.items()}

    @property
    def events(self) -> list[dict[str, Any]]:
        """What happened, as the master and the recorder reported it."""
        columns = self.topic("/ecdaq/event")
        names = list(columns)
        return [dict(zip(names, row, strict=True)) for row in zip(*columns.values(), strict=True)]

    @property
    def clock(self) -> Clock:
        """How well the time is known: of the time map, and of the host's clock."""
        return clock_of(self.topic(TIMEMAP), self.files[0])

    # Other formats

    def to_pandas(self) -> Any:
        """A DataFrame: UTC as its index, session, cycle, dc_time_ns, then the channels.

        Physical values are float64 with NaN; unscaled integers are pandas' nullable ones, so that
        they are exact. attrs["units"] has the units, attrs["gaps"] the number of gaps.
        """
        return export.to_pandas(self.table)

    def to_arrow(self) -> Any:
        """A pyarrow Table: units and gaps in the metadata of fields and table, bad samples null."""
        return export.to_arrow(self.table)

    def to_parquet(self, path: Where) -> None:
        """to_arrow() as a Parquet file."""
        export.to_parquet(self.table, path)

    def to_hdf5(self, path: Where) -> None:
        """An HDF5 file: one dataset a channel with the attribute units, and the gaps."""
        export.to_hdf5(self.table, path)

    def to_tdms(self, path: Where) -> None:
        """A TDMS file: one channel a channel with the property unit_string, and the gaps."""
        export.to_tdms(self.table, path)

    def plot(self) -> Any:
        """Draw with matplotlib, one axes for each unit; the line breaks at gaps. The Figure."""
        return export.plot(self.table)

    # Reading

    def _may_have(self, file: RecordedFile, chunk: Chunk) -> bool:
        """Whether a chunk may have what is selected by UTC. The heads of chunks are only covered by
        a CRC where there is a summary."""
        times = [limit for limit in self._limits if limit.column == "utc_ns"]
        return not file.is_finished or all(
            chunk.end_ns >= limit.first and chunk.start_ns <= limit.last for limit in times
        )

    def _of_file(self, file: RecordedFile) -> dict[int, list[str]]:
        """The fields to be read of each of its slaves."""
        names = {c.name for c in self.channels}
        found: dict[int, list[str]] = {}
        for slave in dict.fromkeys(c.slave for c in file.channels if c.name in names):
            topic = file.topic_of(slave)
            if topic is not None:
                chosen = [c for c in file.channels if c.slave == slave and c.name in names]
                fields = [self._field(file, c) for c in chosen]
                found[topic.id] = [f for f in COMMON if f != "flags"] + fields
        return found

    def _field(self, file: RecordedFile, channel: Channel) -> str:
        """The field of the message that has the values asked for."""
        if not self._raw:
            return channel.field
        if channel.raw_field is None:
            raise RecordingError(
                file.name, f"{channel.name} was recorded as physical values only (record.values)"
            )
        return channel.raw_field

    def _selected(self, file: RecordedFile) -> tuple[int, int]:
        """From which chunk of @file to before which there may be what is selected."""
        chunks = file.chunks
        low, high = 0, len(chunks)
        for limit in self._limits if file.is_finished else []:
            if limit.column == "utc_ns":
                low = max(low, sum(1 for _ in itertools.takewhile(
                    lambda c, v=limit: c.end_ns < v.first, chunks)))  # fmt: skip
                high = min(high, len(chunks) - sum(1 for _ in itertools.takewhile(
                    lambda c, v=limit: c.start_ns > v.last, reversed(chunks))))  # fmt: skip
                continue
            of_chunk = self._range_of(file, limit.column)
            count = len(chunks)
            low = max(low, first_index(count, lambda n, k=of_chunk, v=limit: k(n)[1] >= v.first))
            high = min(high, first_index(count, lambda n, k=of_chunk, v=limit: k(n)[0] > v.last))
        return low, high

    def _range_of(self, file: RecordedFile, column: str) -> Callable[[int], tuple[int, int]]:
        """A function of the number of a chunk: the smallest and largest value of a column in it."""
        wanted = {topic: [column] for topic in self._of_file(file)}
        known: dict[int, tuple[int, int]] = {}

        def of_chunk(number: int) -> tuple[int, int]:
            if number not in known:
                found = file.read_columns([file.chunks[number]], wanted, Room())
                values = [part[column] for parts in found.values() for part in parts]
                # A chunk without samples: as the one before.
                known[number] = (
                    (int(min(v.min() for v in values)), int(max(v.max() for v in values)))
                    if values
                    else of_chunk(number - 1) if number > 0 else (-LAST, -LAST)
                )  # fmt: skip
            return known[number]

        return of_chunk

    def _tasks(self) -> Iterator[tuple[RecordedFile, list[Task]]]:
        """What is to be read, and of the file before and behind it one chunk more, as in a file: so
        a gap at the edge of the selection is seen."""
        files = [(f, *self._selected(f)) for f in self._files if self._of_file(f)]
        inside = [n for n, (_, low, high) in enumerate(files) if low < high]
        near = range(inside[0] - 1, inside[-1] + 2) if inside else range(len(files))
        for n, (file, low, high) in enumerate(files):
            first, end = min(low, high), max(low, high)
            chunks = file.chunks[max(0, first - 1) : end + 1] if n in near else []
            if chunks:
                yield file, [(file, batch, self._of_file(file)) for batch in file.batches(chunks)]

    def _load(self) -> Table:
        by_file = list(self._tasks())
        expected: dict[tuple[int, str], int] = {}
        for file, _ in by_file:
            for number, count in file.contents.of_topic.items():
                if (topic := file.contents.topics.get(number)) is not None:
                    key = file.session, topic.metadata.get("slave", "")
                    expected[key] = expected.get(key, 0) + count
        results = run([task for _, tasks in by_file for task in tasks])
        by_session: dict[int, dict[str, Joined]] = {}
        for file, tasks in by_file:
            slaves = by_session.setdefault(file.session, {})
            for found in itertools.islice(results, len(tasks)):
                for number, parts in found.items():
                    slave = file.contents.topics[number].metadata["slave"]
                    if parts and slave not in slaves:
                        slaves[slave] = Joined(expected.get((file.session, slave), 0))
                    for part in parts:
                        slaves[slave].add(self._values(file, slave, part))
        sessions = []
        for session, slaves in by_session.items():
            samples = [self._samples(slave, joined.columns()) for slave, joined in slaves.items()]
            if samples:
                sessions.append(SessionRows(session, samples))
        return clip(build(sessions, self.units), self._limits)

    def _values(self, file: RecordedFile, slave: str, part: Columns) -> Columns:
        """The channels of @part by their names, as physical values."""
        found = {name: part[name] for name in (TIME, "cycle", "dc_time_ns", "good")}
        for channel in file.channels:
            if channel.slave != slave or channel.name not in self.units:
                continue
            field = self._field(file, channel)
            if field in part:
                found[channel.name] = part[field] if self._raw else channel.value(part[field])
        return found

    def _samples(self, slave: str, columns: Columns) -> SlaveSamples:
        cycle, utc = columns.pop("cycle"), columns.pop(TIME)
        if len(cycle) and max(cycle.max(), utc.max()) > LAST:
            raise RecordingError(self._files[0].name, f"{slave}: a cycle or time beyond 2**63")
        dc, good = columns.pop("dc_time_ns"), columns.pop("good")
        return SlaveSamples(
            slave, signed(cycle), signed(utc), signed(dc),
            np.ones(len(good), bool) if self._raw else good, columns,
        )  # fmt: skip


def signed(values: np.ndarray) -> np.ndarray:
    """As int64, which all of them are known to fit in."""
    return (
        values.view(np.int64) if values.dtype == np.uint64 else values.astype(np.int64, copy=False)
    )


def first_index(count: int, is_past: Callable[[int], bool]) -> int:
    """The first of @count for which @is_past holds, which then holds for all behind it."""
    low, high = 0, count
    while low < high:
        middle = (low + high) // 2
        low, high = (low, middle) if is_past(middle) else (middle + 1, high)
    return low


def any_match(name: str, wanted: list[str]) -> bool:
    return any(fnmatch.fnmatchcase(name, pattern) for pattern in wanted)


def fnmatch_escape(name: str) -> str:
    """A pattern that matches only this name."""
    return "".join(f"[{c}]" if c in "*?[" else c for c in name)


def require(wanted: list[str], known: list[str], what: str) -> None:
    """ValueError for a pattern that matches none of @known."""
    for pattern in wanted:
        if not any(fnmatch.fnmatchcase(name, pattern) for name in known):
            there_are = " ".join(dict.fromkeys(known)) or "none"
            raise ValueError(f"no {what} {pattern}: there are: {there_are}")
