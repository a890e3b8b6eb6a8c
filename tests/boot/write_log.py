# SPDX-License-Identifier: MIT
"""A log of the writes and flushes of a disk, and the disks that a power cut would have left.

The log is that of QEMU's block driver blklogwrites (the format of Linux' dm-log-writes, version 1):
a sector with the number of entries; then each entry, a sector of its own, followed by what was
written. Model of the disk: app/doc/explanation/adr/0062-replay-the-writes-of-a-disk.md.
"""

from __future__ import annotations

import mmap
import os
import struct
from bisect import bisect_left
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from enum import Enum, IntFlag
from pathlib import Path
from random import Random

SECTOR = 512
MAGIC, VERSION = 0x6A736677736872, 1
HEAD = struct.Struct("<QQQI")  # magic, version, entries, bytes of a sector
ENTRY = struct.Struct("<QQQQ")  # sector, sectors, flags, length of a mark
COPY_BYTES = 1 << 20


class Flag(IntFlag):
    """Linux, drivers/md/dm-log-writes.c. Marks (8) are made by hand, which QEMU has no way for."""

    FLUSH = 1
    FUA = 2
    DISCARD = 4


@dataclass(frozen=True)
class Entry:
    """A write, a flush before it (a flush alone has no sectors), or both."""

    sector: int
    sectors: int
    flags: Flag
    data_at: int  # in the log

    @property
    def end(self) -> int:
        """Where the next entry begins in the log."""
        return self.data_at + (0 if Flag.DISCARD in self.flags else self.sectors * SECTOR)


class WriteLog:
    """The entries of a log, and what they wrote."""

    def __init__(self, path: Path) -> None:
        with path.open("rb") as file:
            self.bytes = mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ)
        magic, version, count, sector_bytes = HEAD.unpack_from(self.bytes)
        if (magic, version, sector_bytes) != (MAGIC, VERSION, SECTOR):
            raise ValueError(f"{path}: not a log of writes with sectors of {SECTOR} bytes")
        self.entries: list[Entry] = []
        at = SECTOR
        for number in range(count):
            sector, sectors, flags, _ = ENTRY.unpack_from(self.bytes, at)
            if flags & ~sum(Flag):
                raise ValueError(f"{path}: entry {number} has flags {flags:#x}")
            self.entries.append(Entry(sector, sectors, Flag(flags), at + SECTOR))
            at = self.entries[-1].end
        self.ends = [entry.end for entry in self.entries]

    def data(self, entry: Entry) -> bytes:
        """What was written; zeros for a discard and for a hole at the end of the log."""
        return self.bytes[entry.data_at : entry.end].ljust(entry.sectors * SECTOR, b"\0")

    def count_at(self, position: int) -> int:
        """How many entries there were when the log was `position` bytes long."""
        return bisect_left(self.ends, position) + 1


class Fate(Enum):
    """What becomes of the writes that no flush followed."""

    KEPT = "all kept"
    DROPPED = "none kept"
    MIXED = "kept or dropped"
    TORN = "kept, dropped or torn"


def sectors_kept(fate: Fate, sectors: int, keep: float, dice: Random) -> Iterable[int]:
    """The sectors of one write that reach the medium; `keep` is the chance of a whole write."""
    everything, nothing = range(sectors), range(0)
    if fate is Fate.KEPT or (fate is not Fate.DROPPED and dice.random() < keep):
        return everything
    if fate is Fate.TORN and sectors > 1 and dice.random() < 0.5:
        return sorted(dice.sample(everything, dice.randrange(1, sectors)))
    return nothing


def data_ranges(file: int, start: int, end: int) -> Iterator[tuple[int, int]]:
    """Where a sparse file has data: from, to."""
    while start < end:
        try:
            start = os.lseek(file, start, os.SEEK_DATA)
        except OSError:  # ENXIO: there are none behind
            return
        if start >= end:
            return
        stop = min(os.lseek(file, start, os.SEEK_HOLE), end)
        yield start, stop
        start = stop


def copy_sparse(source: Path, target: Path, start: int, length: int) -> None:
    """A part of a sparse file as a file of its own."""
    with source.open("rb") as old, target.open("wb") as new:
        new.truncate(length)
        for first, last in data_ranges(old.fileno(), start, start + length):
            for at in range(first, last, COPY_BYTES):
                block = os.pread(old.fileno(), min(COPY_BYTES, last - at), at)
                os.pwrite(new.fileno(), block, at - start)


class Partition:
    """A partition while the log is replayed.

    `durable` holds all that a flush has followed; `pending` is what was written since.
    """

    def __init__(
        self, log: WriteLog, base: Path, durable: Path, first_sector: int, sectors: int
    ) -> None:
        self.log = log
        self.durable = durable
        self.first, self.behind = first_sector, first_sector + sectors
        self.bytes = sectors * SECTOR
        self.count = 0
        self.writes = 0
        self.pending: list[Entry] = []
        copy_sparse(base, durable, first_sector * SECTOR, self.bytes)

    def part_of(self, entry: Entry) -> Entry:
        """What of a write is in this partition: no sectors, if nothing is."""
        first = max(entry.sector, self.first)
        sectors = max(min(entry.sector + entry.sectors, self.behind) - first, 0)
        return Entry(first, sectors, entry.flags, entry.data_at + (first - entry.sector) * SECTOR)

    def go_to(self, count: int) -> None:
        """Replay until `count` entries are written."""
        if count < self.count:
            raise ValueError("a replay goes forward only")
        for entry in self.log.entries[self.count : count]:
            if Flag.FLUSH in entry.flags:
                self.settle()
            part = self.part_of(entry)
            if part.sectors > 0:
                self.pending.append(part)
                self.writes += 1
        self.count = count

    def settle(self) -> None:
        """A flush: what was written is durable."""
        with self.durable.open("r+b") as file:
            for entry in self.pending:
                self.write(file.fileno(), entry, range(entry.sectors))
        self.pending = []

    def leave(self, target: Path, fate: Fate, dice: Random) -> None:
        """The partition as a power cut may leave it now."""
        keep = dice.choice((0.1, 0.5, 0.9))
        copy_sparse(self.durable, target, 0, self.bytes)
        with target.open("r+b") as file:
            for entry in self.pending:
                is_durable = Flag.FUA in entry.flags
                kept = sectors_kept(Fate.KEPT if is_durable else fate, entry.sectors, keep, dice)
                self.write(file.fileno(), entry, kept)

    def write(self, file: int, entry: Entry, sectors: Iterable[int]) -> None:
        data = self.log.data(entry)
        at = (entry.sector - self.first) * SECTOR
        if isinstance(sectors, range) and len(sectors) == entry.sectors:
            os.pwrite(file, data, at)
            return
        for s in sectors:
            os.pwrite(file, data[s * SECTOR : (s + 1) * SECTOR], at + s * SECTOR)
