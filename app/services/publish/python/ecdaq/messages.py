# SPDX-License-Identifier: MIT
"""The messages of one recording as columns."""

from __future__ import annotations

import os
import threading
from collections.abc import Iterable, Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ecdaq.blocks import Block, Pattern, Scanner
from ecdaq.container import Chunk, FormError, McapFile, Room, Topic
from ecdaq.definitions import Definition, DefinitionError, Layout
from ecdaq.errors import RecordingError
from ecdaq.sources import NAME, Source

TIME = "log_time_ns"
# Fields of every slave's message that are not channels.
COMMON = ("cycle", "dc_time_ns", "flags", "good")
# Rows that room is made for at once.
ROWS_LEAST, ROWS_MOST = 1024, 1 << 26
LAYOUTS_KEPT = 16  # of one channel and size
Columns = dict[str, np.ndarray]


@dataclass(frozen=True)
class Channel:
    """One variable of a slave, as it is in the table."""

    name: str
    slave: str
    field: str  # of the slave's message
    type: str  # of the field, as in the definition
    unit: str
    scale: float  # value = field * scale + offset
    offset: float
    # With the bits of the process image: another one where the field is physical; None: not there.
    raw_field: str | None

    @property
    def is_integer(self) -> bool:
        """An unscaled integer or BOOL; its values are exact. All else is float64."""
        return (self.scale, self.offset) == (1, 0) and not self.type.startswith("float")

    def value(self, raw: np.ndarray) -> np.ndarray:
        if self.is_integer:
            return raw
        if (self.scale, self.offset) == (1, 0):
            return raw.astype(np.float64, copy=False)
        found = raw.astype(np.float64)
        found *= self.scale
        found += self.offset
        return found


class RecordedFile(McapFile):
    """One file of a recording."""

    def __init__(self, source: Source) -> None:
        super().__init__(source)
        self._layouts: dict[tuple[int, int], list[Layout]] = {}
        self._usual: Pattern = ()

    @cached_property
    def topics(self) -> dict[str, Topic]:
        return {topic.name: topic for topic in self.contents.topics.values()}

    @cached_property
    def definitions(self) -> dict[int, Definition]:
        """The definition of each channel's messages."""
        found = {}
        try:
            for topic in self.contents.topics.values():
                schema = self.contents.schemas.get(topic.schema)
                if schema is None:
                    raise DefinitionError(f"{topic.name} has no definition")
                if (topic.encoding, schema.encoding) == ("cdr", "ros2msg"):
                    found[topic.id] = Definition(schema.name, schema.text)
        except DefinitionError as error:
            raise RecordingError(self.name, str(error)) from error
        return found

    @cached_property
    def channels(self) -> list[Channel]:
        """The channels of all slaves."""
        found = []
        for topic in self.contents.topics.values():
            slave = topic.metadata.get("slave")
            definition = self.definitions.get(topic.id)
            if slave is None or definition is None:
                continue
            fields = {m.name: m for m in definition.members}
            if not set(COMMON) <= set(fields):
                continue
            of_topic = [
                self._channel(topic, slave, name, member.type)
                for name, member in fields.items()
                if name not in COMMON and f"{name}.channel" in topic.metadata
            ]
            found += physical(of_topic)
        if not found and not any(n.startswith("/ecdaq/") for n in self.topics):
            raise RecordingError(self.name, "not a recording of ecdaq: it has no topic /ecdaq/...")
        return found

    def _channel(self, topic: Topic, slave: str, field: str, kind: str) -> Channel:
        of_field = topic.metadata.get
        try:
            scale = float(of_field(f"{field}.scale", "1"))
            offset = float(of_field(f"{field}.offset", "0"))
        except ValueError as error:
            raise RecordingError(self.name, f"{topic.name} {field}: {error}") from error
        unit = of_field(f"{field}.unit", "")
        name = of_field(f"{field}.channel", field)
        raw = of_field(f"{field}.raw", field) or None
        return Channel(name, slave, field, kind, unit, scale, offset, raw)

    def topic_of(self, slave: str) -> Topic | None:
        """The topic of a slave's samples."""
        topics = self.contents.topics.values()
        return next((t for t in topics if t.metadata.get("slave") == slave), None)

    @cached_property
    def session(self) -> int:
        """The session of the master that was recorded."""
        text = self.metadata("ecdaq.session").get("session", "")
        if text.isascii() and text.isdigit() and len(text) < 20:
            return int(text)
        match = NAME.search(self.name)
        return int(match[1], 16) if match else 0

    def layouts(self, block: Block) -> Iterator[tuple[Block, Layout]]:
        """@block in pieces, in their order, each with the layout of its messages."""
        known = self._layouts.setdefault((block.channel, block.rows.size), [])
        for layout in known:
            if layout.fits(block.rows).all():
                yield block, layout
                return
        first = self._new_layout(block)
        if first.fits(block.rows).all():
            if len(known) < LAYOUTS_KEPT:
                known.append(first)
            yield block, first
            return
        for n in range(block.rows.count):  # strings of different lengths
            one = Block(block.channel, block.rows.only(n))
            yield one, self._new_layout(one)

    def _new_layout(self, block: Block) -> Layout:
        definition = self.definitions.get(block.channel)
        if definition is None:
            raise DefinitionError(f"messages of channel {block.channel} without definition")
        return definition.layout(block.rows.octets_of(0))

    def read_columns(
        self, batch: list[Chunk], wanted: Mapping[int, Iterable[str] | None], room: Room
    ) -> dict[int, list[Columns]]:
        """Of the channels of @wanted their fields (None: all), with TIME, as far as they are in
        @batch: parts in the order of the file. @room: of this thread."""
        found: dict[int, list[Columns]] = {number: [] for number in wanted}
        try:
            scanner = Scanner(self.read(batch, room), self._usual)
            for block in scanner.blocks():
                if block.channel not in wanted:
                    continue
                names = wanted[block.channel]
                for part, layout in self.layouts(block):
                    columns = {TIME: native(part.times)}
                    for name in layout.leaves if names is None else names:
                        columns[name] = native(layout.column(part.rows, layout.leaves[name]))
                    found[block.channel].append(columns)
            self._usual = scanner.usual
        except FormError as error:
            raise self.fail(error) from error
        except DefinitionError as error:
            raise RecordingError(self.name, str(error)) from error
        except KeyError as error:
            raise RecordingError(self.name, f"no field {error} in a message") from error
        return found


def physical(channels: list[Channel]) -> list[Channel]:
    """Each channel once. Of two fields of one channel the physical one is first and names the raw
    one."""
    found: dict[str, Channel] = {}
    for channel in channels:
        found.setdefault(channel.name, channel)
    return list(found.values())


def native(column: np.ndarray) -> np.ndarray:
    """A copy in the byte order of this machine."""
    return np.array(column, column.dtype.newbyteorder("="))


def join(parts: list[Columns]) -> Columns:
    """One column of all parts; of objects where their shapes differ."""
    names = dict.fromkeys(name for part in parts for name in part)
    found = {}
    for name in names:
        columns = [part.get(name) for part in parts]
        if all(c is not None and c.shape[1:] == columns[0].shape[1:] for c in columns):
            found[name] = np.concatenate(columns)
            continue
        rows: list[object] = []
        for part, column in zip(parts, columns, strict=True):
            rows += [None] * len(part[TIME]) if column is None else list(column)
        found[name] = np.empty(len(rows), object)
        found[name][:] = rows
    return found


class Joined:
    """Parts put one behind the other while they come, each copied once."""

    def __init__(self, expected: int) -> None:
        self._room = min(max(expected, ROWS_LEAST), ROWS_MOST)
        self._columns: Columns = {}
        self._count = 0
        self._parts: list[Columns] = []  # not alike: join() does it

    def _is_alike(self, part: Columns) -> bool:
        return part.keys() == self._columns.keys() and all(
            (v.dtype, v.shape[1:]) == (self._columns[k].dtype, self._columns[k].shape[1:])
            for k, v in part.items()
        )

    def add(self, part: Columns) -> None:
        count = len(part[TIME])
        if not self._columns and not self._parts:
            self._columns = self._new(part)
        if not self._parts and not self._is_alike(part):
            self._parts = [self._taken()]
        if self._parts:
            self._parts.append(part)
            return
        if self._count + count > self._room:
            self._room = max(2 * self._room, self._count + count)
            old = self._taken()
            self._columns = self._new(old)
            for name, values in old.items():
                self._columns[name][: self._count] = values
        for name, values in part.items():
            self._columns[name][self._count : self._count + count] = values
        self._count += count

    def _new(self, like: Columns) -> Columns:
        return {k: np.empty((self._room, *v.shape[1:]), v.dtype) for k, v in like.items()}

    def _taken(self) -> Columns:
        return {name: values[: self._count] for name, values in self._columns.items()}

    def columns(self) -> Columns:
        return join(self._parts) if self._parts else self._taken()


Task = tuple[RecordedFile, list[Chunk], Mapping[int, Iterable[str] | None]]


def run(tasks: list[Task]) -> Iterator[dict[int, list[Columns]]]:
    """read_columns() of all tasks, on all processors; results in the order of @tasks."""
    local = threading.local()

    def read(task: Task) -> dict[int, list[Columns]]:
        if not hasattr(local, "room"):
            local.room = Room()
        return task[0].read_columns(task[1], task[2], local.room)

    workers = min(8, os.cpu_count() or 1, len(tasks))
    if workers < 2:
        yield from map(read, tasks)
        return
    with ThreadPoolExecutor(workers) as pool:
        yield from pool.map(read, tasks)
