# SPDX-License-Identifier: MIT
"""Disks that a power cut would have left, checked without booting them: e2fsck repairs the data
partition without questions, the recorder repairs its files, and they hold what was acknowledged.
"""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import tempfile
from bisect import bisect_right
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, field
from multiprocessing import get_context
from pathlib import Path
from random import Random
from statistics import median
from typing import Any

from write_log import Fate, Partition, WriteLog

BIN = Path(os.environ.get("ECDAQ_BIN_DIR", Path(__file__).parents[2] / "build" / "stage" / "bin"))
ENVIRONMENT = os.environ | {"PATH": os.environ["PATH"] + ":/usr/sbin:/sbin", "LC_ALL": "C"}
TOOL_S = 120
SCRATCH_BYTES = 2 << 30
# Cycles of each session.
Cycles = dict[int, set[int]]


@dataclass(frozen=True)
class Acknowledged:
    """What the recorder said is on the disk, before the log was `position` bytes long."""

    position: int
    session: int
    first_cycle: int
    last_cycle: int

    def cycles(self) -> set[int]:
        return set(range(self.first_cycle, self.last_cycle + 1))


@dataclass(frozen=True)
class Source:
    """A machine's log of writes, and the disk before it."""

    log: Path
    base: Path
    first_sector: int
    sectors: int
    acknowledged: tuple[Acknowledged, ...]

    def partition(self, work: Path) -> Partition:
        return Partition(
            WriteLog(self.log), self.base, work / "durable", self.first_sector, self.sectors
        )


@dataclass(frozen=True)
class Cut:
    """One disk: how many entries of the log were written, and what became of the pending ones."""

    number: int
    count: int
    fate: Fate


@dataclass
class Found:
    """What is on a disk."""

    is_repaired: bool = False
    problems: list[str] = field(default_factory=list)
    cycles: Cycles = field(default_factory=dict)


@dataclass(frozen=True)
class Result:
    cut: Cut
    pending: int
    is_repaired: bool
    lost: int  # acknowledged cycles
    beyond: int  # cycles that were not yet acknowledged
    problems: tuple[str, ...]


def run(*command: str | Path) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        command, env=ENVIRONMENT, capture_output=True, text=True, timeout=TOOL_S, check=False
    )


def check_file_system(disk: Path, found: Found) -> None:
    """As the machine's preinit does; then a full check finds nothing left to repair."""
    repair = run("e2fsck", "-p", disk)
    found.is_repaired = repair.returncode == 1
    if repair.returncode not in (0, 1):
        found.problems.append(f"e2fsck -p: {repair.returncode}: {repair.stdout.strip()[-200:]}")
        return
    again = run("e2fsck", "-f", "-n", disk)
    if again.returncode != 0:
        found.problems.append(f"e2fsck -f -n: {again.returncode}: {again.stdout.strip()[-200:]}")


def recover(folder: Path, run_dir: Path) -> None:
    """The recorder repairs what is unfinished before it waits for a master."""
    with subprocess.Popen(
        [BIN / "ecdaq-record", "--dir", folder, "--run-dir", run_dir],
        stderr=subprocess.PIPE,
        text=True,
    ) as recorder:
        assert recorder.stderr is not None
        said = next((line for line in recorder.stderr if "waiting for" in line), None)
        recorder.terminate()
    assert said is not None, f"ecdaq-record did not start in {folder}"


def check_recordings(folder: Path, found: Found) -> None:
    checked = run(BIN / "ecdaq", "log", "check", folder, "--json")
    report: dict[str, Any] = json.loads(checked.stdout)
    if not report["clean"]:
        found.problems.append(f"ecdaq log check: {checked.stdout.strip()[-300:]}")
    for file in report["files"]:
        if file["damaged"] or file["cycles"] == 0:
            continue
        cycles = found.cycles.setdefault(int(file["session"]), set())
        cycles.update(range(file["first_cycle"], file["last_cycle"] + 1))
        for gap in file["gaps"]:
            cycles.difference_update(range(gap["first"], gap["first"] + gap["count"]))


def look_at(disk: Path) -> Found:
    """Repair a data partition, and read its recordings."""
    found = Found()
    check_file_system(disk, found)
    with tempfile.TemporaryDirectory(dir=disk.parent) as name:
        work = Path(name)
        run("debugfs", "-R", f"rdump /record {work}", disk)
        folder = work / "record"
        if folder.is_dir():
            (work / "run").mkdir()
            recover(folder, work / "run")
            check_recordings(folder, found)
        else:
            found.problems.append("no folder record")
    return found


def acknowledged_at(source: Source, log: WriteLog) -> list[tuple[int, Acknowledged]]:
    """From which number of entries on each holds; what was said after the last flush is left out,
    as the log does not count what was written then."""
    usable = [(log.count_at(a.position), a) for a in source.acknowledged]
    return [(count, a) for count, a in usable if count <= len(log.entries)]


def make_cuts(source: Source, disks: int, seed: int, log: WriteLog) -> list[Cut]:
    """In order of the log. A quarter at an acknowledgement, the rest behind any write since the
    first; each fate as often."""
    dice = Random(seed)
    said = [count for count, _ in acknowledged_at(source, log)]
    end = source.first_sector + source.sectors
    writes = [
        n
        for n, entry in enumerate(log.entries, 1)
        if n >= said[0] and source.first_sector <= entry.sector < end
    ]
    fates = list(Fate)
    cuts = [
        Cut(n, dice.choice(said if n // len(fates) % 4 == 0 else writes), fates[n % len(fates)])
        for n in range(disks)
    ]
    return sorted(cuts, key=lambda cut: cut.count)


def examine(source: Source, cuts: Sequence[Cut], seed: int) -> list[Result]:
    """Make and check one disk after the other; `cuts` are in order of the log."""
    results = []
    with tempfile.TemporaryDirectory(dir=scratch()) as name:
        partition = source.partition(Path(name))
        disk = Path(name) / "disk"
        acknowledged = acknowledged_at(source, partition.log)
        partition.go_to(acknowledged[0][0])
        # What earlier sessions left was repaired and synced before this one was recorded.
        earlier = earlier_cycles(partition, disk, acknowledged[0][1].session)
        for cut in cuts:
            partition.go_to(cut.count)
            partition.leave(disk, cut.fate, Random(f"{seed}:{cut.number}"))
            _, said = acknowledged[bisect_right(acknowledged, cut.count, key=lambda a: a[0]) - 1]
            found = look_at(disk)
            wanted = earlier | {said.session: said.cycles()}
            lost = sum(len(w - found.cycles.get(s, set())) for s, w in wanted.items())
            there = found.cycles.get(said.session, set())
            results.append(
                Result(
                    cut,
                    len(partition.pending),
                    found.is_repaired,
                    lost,
                    len(there - said.cycles()),
                    tuple(found.problems),
                )
            )
    return results


def earlier_cycles(partition: Partition, disk: Path, session: int) -> Cycles:
    partition.leave(disk, Fate.KEPT, Random(0))
    found = look_at(disk)
    assert not found.problems, found.problems
    return {s: cycles for s, cycles in found.cycles.items() if s != session}


def scratch() -> str | None:
    """In memory, if there is room for the disks of all processors."""
    memory = Path("/dev/shm")
    has_room = memory.is_dir() and shutil.disk_usage(memory).free > SCRATCH_BYTES
    return str(memory) if has_room else None


def share_out(
    look: Callable[[Any, Sequence[Cut], int], list[Any]], source: Any, cuts: list[Cut], seed: int
) -> list[Any]:
    """Let each processor look at its part of the cuts, which stay in order of the log."""
    workers = os.cpu_count() or 1
    shares = [
        cuts[len(cuts) * w // workers : len(cuts) * (w + 1) // workers] for w in range(workers)
    ]
    with ProcessPoolExecutor(workers, get_context("fork")) as pool:
        parts = pool.map(look, [source] * workers, shares, [seed] * workers)
        return [result for part in parts for result in part]


def examine_all(source: Source, disks: int, seed: int) -> list[Result]:
    """Share the disks out to all processors."""
    return share_out(examine, source, make_cuts(source, disks, seed, WriteLog(source.log)), seed)


def is_bad(result: Result) -> bool:
    return result.lost > 0 or bool(result.problems)


def table(results: Iterable[Result]) -> Iterator[str]:
    """One row for each fate of the writes that no flush followed."""
    rows = list(results)
    yield (
        f"{'writes since the last flush':27} {'disks':>6} {'writes':>12} {'repaired':>9}"
        f" {'bad':>4} {'lost':>5} {'beyond':>10}"
    )
    for fate in Fate:
        of = [r for r in rows if r.cut.fate is fate]
        pending = f"{median(r.pending for r in of):.0f}, {max(r.pending for r in of)}"
        beyond = f"{median(r.beyond for r in of):.0f}, {max(r.beyond for r in of)}"
        yield (
            f"{fate.value:27} {len(of):6} {pending:>12} {sum(r.is_repaired for r in of):9}"
            f" {sum(bool(r.problems) for r in of):4} {sum(r.lost for r in of):5} {beyond:>10}"
        )
