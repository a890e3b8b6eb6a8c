# SPDX-License-Identifier: MIT
"""The replayer of tests/boot: what a cut may leave of a disk, and that the checks of such a disk
find what is lost. The logs are made here, in the format of QEMU's blklogwrites.
"""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from dataclasses import dataclass, replace
from pathlib import Path
from random import Random

import pytest
from conftest import TOP

sys.path.append(str(TOP / "tests" / "boot"))
import cut_disks
from cut_disks import Acknowledged, Cut, Source
from write_log import ENTRY, HEAD, MAGIC, SECTOR, VERSION, Fate, Flag, Partition, WriteLog

SBIN = os.environ | {"PATH": os.environ["PATH"] + ":/usr/sbin:/sbin"}
# Where the partition of these tests begins, and its size.
FIRST, SECTORS = 64, 16
RECORDING = TOP / "tests" / "cli" / "recordings" / "bad_slaves_in_one_word.mcap"
SESSION, CYCLES = 1795334998610917448, 20
BLOCK = 4096


@dataclass(frozen=True)
class Op:
    """A line of a log: a write of `data` at `sector`, or only its flags."""

    sector: int = 0
    data: bytes = b""
    flags: int = 0
    discarded: int = 0


FLUSH = Op(flags=Flag.FLUSH)


def write(sector: int, letter: str, sectors: int = 1, flags: int = 0) -> Op:
    return Op(FIRST + sector, letter.encode() * SECTOR * sectors, flags)


def write_log(path: Path, ops: list[Op]) -> Path:
    def sector(text: bytes) -> bytes:
        return text.ljust(SECTOR, b"\0")

    with path.open("wb") as log:
        log.write(sector(HEAD.pack(MAGIC, VERSION, len(ops), SECTOR)))
        for op in ops:
            sectors = op.discarded or len(op.data) // SECTOR
            log.write(sector(ENTRY.pack(op.sector, sectors, op.flags, 0)) + op.data)
    return path


def partition(tmp_path: Path, *ops: Op) -> Partition:
    """A partition full of dots, between other sectors, with all of `ops` replayed."""
    base = tmp_path / "base"
    base.write_bytes(b"-" * FIRST * SECTOR + b"." * SECTORS * SECTOR + b"-" * 8 * SECTOR)
    log = WriteLog(write_log(tmp_path / "log", list(ops)))
    made = Partition(log, base, tmp_path / "durable", FIRST, SECTORS)
    made.go_to(len(ops))
    return made


def left(made: Partition, fate: Fate, seed: int = 0) -> str:
    """A letter a sector."""
    target = made.durable.with_name("target")
    made.leave(target, fate, Random(seed))
    data = target.read_bytes()
    sectors = [data[at : at + SECTOR] for at in range(0, len(data), SECTOR)]
    assert all(len(set(s)) == 1 for s in sectors), "a sector is never torn"
    return "".join(chr(s[0]) for s in sectors)


def all_left(made: Partition, fate: Fate) -> set[str]:
    return {left(made, fate, seed) for seed in range(60)}


def dots(text: str) -> str:
    return text.ljust(SECTORS, ".")


def test_what_no_flush_followed_may_be_lost(tmp_path: Path) -> None:
    made = partition(tmp_path, write(0, "a"), FLUSH, write(1, "b"), write(2, "c"))
    assert left(made, Fate.KEPT) == dots("abc")
    assert left(made, Fate.DROPPED) == dots("a")
    assert all_left(made, Fate.MIXED) == {dots("a"), dots("ab"), dots("a.c"), dots("abc")}
    assert len(made.pending) == 2


def test_a_flush_makes_everything_before_it_durable(tmp_path: Path) -> None:
    made = partition(tmp_path, write(0, "a", 4), write(1, "b"), FLUSH)
    assert {left(made, fate) for fate in Fate} == {dots("abaa")}
    assert made.pending == []


def test_a_flush_of_a_write_comes_before_the_write(tmp_path: Path) -> None:
    made = partition(tmp_path, write(0, "a"), write(1, "b", flags=Flag.FLUSH))
    assert left(made, Fate.DROPPED) == dots("a")


def test_a_forced_write_is_durable_and_nothing_else(tmp_path: Path) -> None:
    made = partition(tmp_path, write(0, "a", 2), write(1, "b", flags=Flag.FUA), write(2, "c"))
    assert left(made, Fate.DROPPED) == dots(".b")
    assert left(made, Fate.KEPT) == dots("abc")


def test_a_torn_write_keeps_whole_sectors(tmp_path: Path) -> None:
    made = partition(tmp_path, write(0, "a", 3))
    seen = all_left(made, Fate.TORN)
    assert {dots("aaa"), dots("...")} < seen
    assert dots("a.a") in seen, "sectors reach the medium in any order"
    assert dots("..a") in seen
    assert all_left(made, Fate.MIXED) == {dots("aaa"), dots("...")}


def test_the_later_write_to_a_sector_may_be_the_one_that_is_lost(tmp_path: Path) -> None:
    made = partition(tmp_path, write(0, "a"), write(0, "b"))
    assert all_left(made, Fate.MIXED) == {dots(""), dots("a"), dots("b")}
    assert left(made, Fate.KEPT) == dots("b")


def test_a_discard_leaves_zeros_or_nothing_changed(tmp_path: Path) -> None:
    made = partition(tmp_path, Op(FIRST, flags=Flag.DISCARD, discarded=2), write(2, "c"), FLUSH)
    assert left(made, Fate.KEPT) == dots("\0\0c")


def test_a_seed_gives_the_same_disk_again(tmp_path: Path) -> None:
    made = partition(tmp_path, *(write(n, "x", 2) for n in range(0, 16, 2)))
    assert left(made, Fate.TORN, 7) == left(made, Fate.TORN, 7)
    assert len(all_left(made, Fate.TORN)) > 30


def test_only_what_is_in_the_partition_is_written(tmp_path: Path) -> None:
    beside = partition(tmp_path, write(-2, "x", 2), write(SECTORS, "y"))
    assert beside.pending == []
    assert left(beside, Fate.KEPT) == dots("")
    over_the_edges = [
        Op(FIRST - 1, b"x" * SECTOR + b"a" * SECTOR),
        Op(FIRST + SECTORS - 1, b"b" * SECTOR + b"y" * SECTOR),
    ]
    made = partition(tmp_path, *over_the_edges)
    assert left(made, Fate.KEPT) == f"a{'.' * (SECTORS - 2)}b"
    made.settle()
    assert left(made, Fate.DROPPED) == f"a{'.' * (SECTORS - 2)}b"


def test_the_log_is_read_in_order_and_checked(tmp_path: Path) -> None:
    path = write_log(tmp_path / "log", [write(0, "a", 3), FLUSH, write(1, "b")])
    log = WriteLog(path)
    assert [(e.sector, e.sectors, int(e.flags)) for e in log.entries] == [
        (FIRST, 3, 0),
        (0, 0, 1),
        (FIRST + 1, 1, 0),
    ]
    assert log.data(log.entries[2]) == b"b" * SECTOR
    # Head, then 1 + 3, 1 and 1 + 1 sectors.
    assert log.ends == [5 * SECTOR, 6 * SECTOR, 8 * SECTOR]
    assert [log.count_at(n * SECTOR) for n in (5, 6, 7, 8, 9)] == [1, 2, 3, 3, 4]
    with pytest.raises(ValueError, match="forward only"):
        partition(tmp_path, FLUSH, FLUSH).go_to(1)
    for bad in ([Op(flags=8)], [Op(flags=16)]):
        with pytest.raises(ValueError, match="entry 0 has flags"):
            WriteLog(write_log(path, bad))
    path.write_bytes(b"\1" * SECTOR)
    with pytest.raises(ValueError, match="not a log"):
        WriteLog(path)


# --- the checks of a disk ---


def run(*command: str | Path) -> None:
    subprocess.run(command, env=SBIN, check=True, capture_output=True)


def changes(before: bytes, after: bytes) -> list[Op]:
    """The blocks that differ."""
    return [
        Op(FIRST + at // SECTOR, after[at : at + BLOCK])
        for at in range(0, len(after), BLOCK)
        if before[at : at + BLOCK] != after[at : at + BLOCK]
    ]


@dataclass(frozen=True)
class Recorded:
    """An empty data partition, and the writes that put a recording into it."""

    base: Path
    sectors: int
    writes: list[Op]

    def source(self, ops: list[Op], last_cycle: int = CYCLES - 1) -> Source:
        """A log in which, behind `ops`, the recorder says that all is on the disk."""
        log = write_log(self.base.with_name("log"), ops)
        said = Acknowledged(WriteLog(log).ends[-1], SESSION, 0, last_cycle)
        return Source(log, self.base, FIRST, self.sectors, (said,))


def make_recorded(tmp_path: Path, recording: bytes) -> Recorded:
    disk, file = tmp_path / "disk", tmp_path / "file"
    (tmp_path / "tree" / "record").mkdir(parents=True)
    disk.write_bytes(b"")
    os.truncate(disk, 8 << 20)
    run("mke2fs", "-q", "-t", "ext4", "-b", str(BLOCK), "-d", tmp_path / "tree", disk)
    before = disk.read_bytes()
    file.write_bytes(recording)
    run(
        "debugfs",
        "-w",
        "-R",
        f"write {file} record/ecdaq-20260101T000000Z-00000001-000001.part",
        disk,
    )
    base = tmp_path / "base"
    base.write_bytes(bytes(FIRST * SECTOR) + before)
    return Recorded(base, len(before) // SECTOR, changes(before, disk.read_bytes()))


@pytest.fixture
def recorded(tmp_path: Path) -> Recorded:
    return make_recorded(tmp_path, RECORDING.read_bytes())


def examined(source: Source, fate: Fate, count: int) -> cut_disks.Result:
    return cut_disks.examine(source, [Cut(0, count, fate)], 1)[0]


def test_a_recording_that_was_synced_is_found(recorded: Recorded) -> None:
    ops = [*recorded.writes, FLUSH]
    for fate in Fate:
        result = examined(recorded.source(ops), fate, len(ops))
        assert result.problems == ()
        assert (result.lost, result.beyond, result.pending) == (0, 0, 0)
        assert not cut_disks.is_bad(result)


def test_cycles_that_were_not_acknowledged_are_no_loss(recorded: Recorded) -> None:
    ops = [*recorded.writes, FLUSH]
    result = examined(recorded.source(ops, last_cycle=11), Fate.KEPT, len(ops))
    assert (result.lost, result.beyond) == (0, CYCLES - 12)


def test_a_recorder_that_does_not_sync_is_found(recorded: Recorded) -> None:
    ops = recorded.writes
    result = examined(recorded.source(ops), Fate.DROPPED, len(ops))
    assert result.lost == CYCLES
    assert cut_disks.is_bad(result)


def test_a_disk_that_ignores_a_flush_is_found(
    recorded: Recorded, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(Partition, "settle", lambda self: None)
    ops = [*recorded.writes, FLUSH]
    assert examined(recorded.source(ops), Fate.DROPPED, len(ops)).lost == CYCLES


def test_a_recorder_that_says_more_than_it_wrote_is_found(recorded: Recorded) -> None:
    ops = [*recorded.writes, FLUSH]
    result = examined(recorded.source(ops, last_cycle=CYCLES + 4), Fate.KEPT, len(ops))
    assert result.lost == 5


def test_a_recording_without_its_end_is_found(tmp_path: Path) -> None:
    """Its only chunk is cut off."""
    recorded = make_recorded(tmp_path, RECORDING.read_bytes()[: RECORDING.stat().st_size // 4])
    ops = [*recorded.writes, FLUSH]
    assert examined(recorded.source(ops), Fate.KEPT, len(ops)).lost == CYCLES


def test_an_earlier_session_that_is_lost_is_found(recorded: Recorded) -> None:
    """It was there when the newer one began; then its blocks are overwritten."""
    ops = [*recorded.writes, FLUSH]
    source = recorded.source(ops)
    newer = replace(source.acknowledged[0], session=1, last_cycle=-1)
    gone = [replace(op, data=bytes(len(op.data))) for op in recorded.writes]
    log = write_log(source.log, [*ops, *gone, FLUSH])
    result = examined(replace(source, log=log, acknowledged=(newer,)), Fate.KEPT, len(ops))
    assert (result.lost, result.problems) == (0, ())
    lost = examined(
        replace(source, log=log, acknowledged=(newer,)), Fate.KEPT, len(ops) + len(gone)
    )
    assert lost.lost == CYCLES


def test_a_gap_and_a_damaged_file_are_lost_cycles(monkeypatch: pytest.MonkeyPatch) -> None:
    whole = {"session": "7", "damaged": False, "first_cycle": 0, "last_cycle": 9, "cycles": 8}
    whole["gaps"] = [{"first": 3, "count": 2}]
    damaged = whole | {"damaged": True, "first_cycle": 10, "last_cycle": 19}
    answer = json.dumps({"clean": False, "files": [whole, damaged]})
    monkeypatch.setattr(
        cut_disks, "run", lambda *_: subprocess.CompletedProcess((), 1, stdout=answer)
    )
    found = cut_disks.Found()
    cut_disks.check_recordings(Path("any"), found)
    assert found.cycles == {7: {0, 1, 2, 5, 6, 7, 8, 9}}
    assert len(found.problems) == 1


@pytest.mark.parametrize(
    ("where", "found_by"), [("Inode table", "e2fsck -p"), ("Block bitmap", "e2fsck -f -n")]
)
def test_a_damaged_file_system_is_found(recorded: Recorded, where: str, found_by: str) -> None:
    """The root directory's inode asks questions; a bitmap is read only by a full check."""
    shown = subprocess.run(
        ["dumpe2fs", recorded.base.with_name("disk")],
        env=SBIN,
        check=True,
        capture_output=True,
        text=True,
    ).stdout
    found = re.search(rf"{where} at (\d+)", shown)
    assert found is not None
    garbage = Op(FIRST + int(found[1]) * BLOCK // SECTOR, b"\xa5" * BLOCK)
    ops = [*recorded.writes, FLUSH, garbage]
    source = recorded.source(ops)
    before = replace(source.acknowledged[0], position=WriteLog(source.log).ends[-2])
    result = examined(replace(source, acknowledged=(before,)), Fate.KEPT, len(ops))
    assert any(found_by in problem for problem in result.problems), result


def test_cuts_are_behind_writes_and_at_acknowledgements(recorded: Recorded) -> None:
    ops = [*recorded.writes, FLUSH, write(0, "a"), FLUSH, write(1, "b"), write(2, "c")]
    source = recorded.source(ops)
    log = WriteLog(source.log)
    synced = len(recorded.writes) + 1
    said = replace(source.acknowledged[0], position=log.ends[synced - 1])
    unusable = replace(said, position=log.ends[-1] + SECTOR)
    source = replace(source, acknowledged=(said, unusable))
    cuts = cut_disks.make_cuts(source, 400, 1, log)
    assert {c.count for c in cuts} == {synced, synced + 1, synced + 3, synced + 4}
    assert {c.fate for c in cuts} == set(Fate)
    assert [c.count for c in cuts] == sorted(c.count for c in cuts)
    assert sorted(c.number for c in cuts) == list(range(400))
    at_acknowledgement = {c.fate for c in cuts if c.count == synced}
    assert at_acknowledgement == set(Fate)


def test_the_table_has_a_row_for_each_fate(recorded: Recorded) -> None:
    ops = [*recorded.writes, FLUSH, write(0, "a")]
    source = recorded.source(ops)
    synced = replace(source.acknowledged[0], position=WriteLog(source.log).ends[-2])
    results = cut_disks.examine_all(replace(source, acknowledged=(synced,)), 16, 1)
    assert sorted(r.cut.number for r in results) == list(range(16))
    head, *rows = cut_disks.table([*results, replace(results[0], lost=3, problems=("x",))])
    assert head.split()[-2:] == ["lost", "beyond"]
    assert len(rows) == len(Fate)
    assert sum(" 1     3 " in row for row in rows) == 1, rows
