# SPDX-License-Identifier: MIT
"""Disks that a power cut would have left during an update and at the first start after it, checked
without booting them: the boot state names a slot that is whole, and the data partition has what is
the machine's own."""

from __future__ import annotations

import tempfile
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from random import Random

import boot_state
from cut_disks import Cut, Cycles, Found, look_at, run, scratch, share_out
from write_log import SECTOR, Entry, Fate, Partition, WriteLog

STATE, SLOT, DATA = "boot state", "rootB", "data"
COMPARE_BYTES = 4 << 20
# Where the boot state is, with what is between its two copies.
STATE_FIRST = boot_state.PLACES[0][0] // SECTOR
STATE_SECTORS = (boot_state.PLACES[1][0] + boot_state.PLACES[1][1]) // SECTOR - STATE_FIRST


@dataclass(frozen=True)
class Update:
    """What a machine wrote, from slot A to slot B.

    parts: first sector and sectors of what may be written, by name. image: what slot B holds after
    the update. begin, done: length of the log when the update began, and when it was acknowledged.
    own: files of the data partition with their text, which no cut may change.
    """

    name: str
    log: Path
    base: Path
    parts: Mapping[str, tuple[int, int]]
    image: Path
    begin: int
    done: int
    own: Mapping[str, str]


@dataclass(frozen=True)
class Result:
    """slot: what U-Boot starts next."""

    update: str
    cut: Cut
    pending: int
    slot: str | None
    is_acknowledged: bool
    is_repaired: bool
    problems: tuple[str, ...]


def entries_of(log: WriteLog, part: tuple[int, int], first: int) -> list[int]:
    """The numbers of entries behind `first` that wrote to a part of the disk."""
    start, sectors = part
    return [
        number
        for number, entry in enumerate(log.entries, 1)
        if number > first
        and entry.sector < start + sectors
        and start < entry.sector + entry.sectors
    ]


def elsewhere(update: Update) -> list[Entry]:
    """What was written to no part that an update may write."""
    log = WriteLog(update.log)
    known = {n for part in update.parts.values() for n in entries_of(log, part, 0)}
    first = log.count_at(update.begin)
    return [e for n, e in enumerate(log.entries, 1) if n > first and e.sectors and n not in known]


def make_cuts(update: Update, disks: int, seed: int) -> list[Cut]:
    """In order of the log. Each part of the disk as often, whatever was written to it; behind one
    of its writes, or up to three entries later. Each fate as often."""
    dice = Random(seed)
    log = WriteLog(update.log)
    first = log.count_at(update.begin)
    writes = [found for p in update.parts.values() if (found := entries_of(log, p, first))]
    fates = list(Fate)
    cuts = []
    for number in range(disks):
        where = dice.choice(writes[number // len(fates) % len(writes)])
        count = min(where + dice.randrange(4), len(log.entries))
        cuts.append(Cut(number, count, fates[number % len(fates)]))
    return sorted(cuts, key=lambda cut: cut.count)


def is_same(slot: Path, image: Path) -> bool:
    """Whether a slot begins with the whole image."""
    with slot.open("rb") as one, image.open("rb") as other:
        while wanted := other.read(COMPARE_BYTES):
            if one.read(len(wanted)) != wanted:
                return False
    return True


def check_own(disk: Path, own: Mapping[str, str], found: Found) -> None:
    for name, text in own.items():
        there = run("debugfs", "-R", f"cat {name}", disk).stdout
        if there != text:
            found.problems.append(f"{name} is {there[:60]!r}, not {text[:60]!r}")


class Replay:
    """The parts of a machine's disk while the log of an update is replayed."""

    def __init__(self, update: Update, work: Path) -> None:
        self.update = update
        self.work = work
        self.log = WriteLog(update.log)
        self.acknowledged = self.log.count_at(update.done)
        self.parts = {
            name: Partition(self.log, update.base, work / f"durable-{n}", *part)
            for n, (name, part) in enumerate(update.parts.items())
        }
        self.earlier: Cycles = {}
        self.whole_writes = -1  # how many writes there were when slot B was found whole

    def go_to(self, count: int) -> None:
        for part in self.parts.values():
            part.go_to(count)

    def leave(self, name: str, cut: Cut, seed: int) -> Path:
        target = self.work / "left"
        self.parts[name].leave(target, cut.fate, Random(f"{seed}:{cut.number}:{name}"))
        return target

    def is_slot_whole(self, cut: Cut, seed: int) -> bool:
        """The first start after an update does not write it. What is flushed is compared once."""
        if SLOT not in self.parts:
            return True
        part = self.parts[SLOT]
        if part.pending:
            return is_same(self.leave(SLOT, cut, seed), self.update.image)
        if self.whole_writes != part.writes:
            if not is_same(part.durable, self.update.image):
                return False
            self.whole_writes = part.writes
        return True

    def state(self, cut: Cut, seed: int, found: Found) -> str | None:
        """The slot that U-Boot takes, which has to be one that is whole."""
        raw = self.leave(STATE, cut, seed).read_bytes()
        copies = [
            boot_state.unpack(raw[at - STATE_FIRST * SECTOR :][:size])
            for at, size in boot_state.PLACES
        ]
        slot = boot_state.next_slot(copies)
        if copies == [None, None]:
            found.problems.append("no copy of the boot state is whole")
        if slot is None:
            found.problems.append("no slot has a try left")
        if slot == "B" and not self.is_slot_whole(cut, seed):
            found.problems.append("slot B starts next and is not whole")
        if slot != "B" and cut.count >= self.acknowledged:
            found.problems.append(f"slot {slot} starts next, and the update was acknowledged")
        return slot

    def look(self, cut: Cut, seed: int) -> Result:
        self.go_to(cut.count)
        state = Found()
        slot = self.state(cut, seed, state)
        found = look_at(self.leave(DATA, cut, seed))
        check_own(self.work / "left", self.update.own, found)
        lost = sum(len(was - found.cycles.get(s, set())) for s, was in self.earlier.items())
        if lost:
            found.problems.append(f"{lost} recorded cycles are lost")
        return Result(
            self.update.name,
            cut,
            sum(len(part.pending) for part in self.parts.values()),
            slot,
            cut.count >= self.acknowledged,
            found.is_repaired,
            (*state.problems, *found.problems),
        )

    def look_before(self, seed: int) -> None:
        """What was recorded, synced and closed before the update began."""
        cut = Cut(0, self.log.count_at(self.update.begin), Fate.KEPT)
        self.go_to(cut.count)
        found = look_at(self.leave(DATA, cut, seed))
        assert not found.problems, found.problems
        self.earlier = found.cycles


def examine(update: Update, cuts: Sequence[Cut], seed: int) -> list[Result]:
    """Make and check one disk after the other; `cuts` are in order of the log."""
    with tempfile.TemporaryDirectory(dir=scratch()) as name:
        replay = Replay(update, Path(name))
        replay.look_before(seed)
        return [replay.look(cut, seed) for cut in cuts]


def examine_all(update: Update, disks: int, seed: int) -> list[Result]:
    """Share the disks out to all processors."""
    return share_out(examine, update, make_cuts(update, disks, seed), seed)


def whole_disk(update: Update, cut: Cut, seed: int, work: Path, target: Path) -> None:
    """The same disk as a file, to be booted."""
    sectors = update.base.stat().st_size // SECTOR
    disk = Partition(WriteLog(update.log), update.base, work / "durable", 0, sectors)
    disk.go_to(cut.count)
    disk.leave(target, cut.fate, Random(f"{seed}:{cut.number}"))
    (work / "durable").unlink()


def table(results: Iterable[Result]) -> Iterator[str]:
    """One row for each update and fate of the writes that no flush followed."""
    rows = list(results)
    yield (
        f"{'during':14} {'writes since the last flush':27} {'disks':>6} {'A next':>7} {'B next':>7}"
        f" {'acknowledged':>13} {'repaired':>9} {'bad':>4}"
    )
    for name in dict.fromkeys(r.update for r in rows):
        for fate in Fate:
            of = [r for r in rows if r.update == name and r.cut.fate is fate]
            yield (
                f"{name:14} {fate.value:27} {len(of):6} {sum(r.slot == 'A' for r in of):7}"
                f" {sum(r.slot == 'B' for r in of):7} {sum(r.is_acknowledged for r in of):13}"
                f" {sum(r.is_repaired for r in of):9} {sum(bool(r.problems) for r in of):4}"
            )
