# SPDX-License-Identifier: MIT
"""How much faster than real time the whole master runs on virtual time: `./build.sh bench sim`."""

from __future__ import annotations

import os
import re
import statistics
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from measure.page import NotMeasuredError

from bench.page import table

ROOT = Path(__file__).resolve().parents[3]
BUILD = ROOT / "build" / "release"
PROGRAM = "tests/cost/cost_virtual"
PERIOD_S = 1e-3
COUNTED_CYCLES = 100

EXPLAINED = """
The whole master, FB1111-Piccolos with their firmware and the wires on virtual time; 1 ms, DC with
SYNC0, every sample read and hashed.
instructions: user instructions of a cycle in OP (callgrind, {counted} cycles); one more: for each
  slave more than in the row above.
us a cycle: processor time of one run at a time, median of {seeds} seeds, {cycles} cycles each.
times real time: virtual seconds in a second of processor time.
all cores: virtual seconds of all seeds in a second of the clock, {seeds} runs on {cores} cores at
  once, without their bring-ups.
Each seed gave the same samples, to the last byte, alone and beside the others.
""".strip()
COMPARED = """
before: the same program of another build, in turns with this one. Its samples are {same}.
"""


@dataclass
class One:
    """What one run printed."""

    ns_a_cycle: float
    hash: str


@dataclass
class Row:
    """One number of slaves."""

    slaves: int
    instructions: float
    us_a_cycle: float
    times_real_time: float
    all_cores: float
    # Of the build to compare with.
    instructions_before: float | None = None
    us_before: float | None = None
    is_same: bool | None = None


def run_one(build: Path, slaves: int, cycles: int, seed: int) -> One:
    command = [str(build / PROGRAM), "/dev/shm", *map(str, (slaves, cycles, seed))]
    result = subprocess.run(command, capture_output=True, text=True)
    match = re.search(r"(\d+) ns a cycle, .* hash ([0-9a-f]+)", result.stdout)
    if result.returncode != 0 or match is None:
        raise NotMeasuredError(f"{' '.join(command)}: {result.stdout}{result.stderr}".strip())
    return One(float(match[1]), match[2])


def count_one(build: Path, slaves: int) -> float:
    sys.path.insert(0, str(ROOT / "tests" / "cost"))
    from counting import count

    os.environ["ECDAQ_BUILD"] = str(build)
    return count("virtual", slaves, COUNTED_CYCLES).instructions / COUNTED_CYCLES


def in_parallel(slaves: int, cycles: int, alone: list[One], cores: int) -> float:
    """All seeds at once. Virtual seconds a second; the seeds give what they gave alone."""
    seeds = range(1, len(alone) + 1)

    def timed(length: int) -> tuple[float, list[One]]:
        start = time.monotonic()
        with ThreadPoolExecutor(cores) as pool:
            got = list(pool.map(lambda seed: run_one(BUILD, slaves, length, seed), seeds))
        return time.monotonic() - start, got

    bring_ups_s, _ = timed(1)
    whole_s, got = timed(cycles)
    for seed, one, before in zip(seeds, got, alone, strict=True):
        if one.hash != before.hash:
            raise NotMeasuredError(f"{slaves} slaves, seed {seed}: two runs have other samples")
    return len(alone) * (cycles - 1) * PERIOD_S / (whole_s - bring_ups_s)


def measure_row(slaves: int, cycles: int, seeds: int, before: Path | None, cores: int) -> Row:
    now: list[One] = []
    then: list[One] = []
    for seed in range(1, seeds + 1):
        if before is not None:
            then.append(run_one(before, slaves, cycles, seed))
        now.append(run_one(BUILD, slaves, cycles, seed))
    ns = statistics.median(one.ns_a_cycle for one in now)
    row = Row(
        slaves,
        count_one(BUILD, slaves),
        ns / 1e3,
        PERIOD_S * 1e9 / ns,
        in_parallel(slaves, cycles, now, cores),
    )
    if before is not None:
        row.instructions_before = count_one(before, slaves)
        row.us_before = statistics.median(one.ns_a_cycle for one in then) / 1e3
        row.is_same = [one.hash for one in now] == [one.hash for one in then]
    return row


def lines_of(rows: list[Row], cycles: int, seeds: int, cores: int) -> list[str]:
    has_before = rows[0].us_before is not None
    head = ["slaves", "instructions", "one more", "us a cycle", "times real time", "all cores"]
    head += ["instructions before", "us before"] if has_before else []
    texts = []
    last: Row | None = None
    for row in rows:
        more = ""
        if last is not None and row.slaves > last.slaves:
            more_instructions = row.instructions - last.instructions
            more = f"{more_instructions / (row.slaves - last.slaves):.0f}"
        text = [f"{row.slaves}", f"{row.instructions:.0f}", more, f"{row.us_a_cycle:.1f}"]
        text += [f"{row.times_real_time:.1f}", f"{row.all_cores:.1f}"]
        if row.instructions_before is not None and row.us_before is not None:
            text += [f"{row.instructions_before:.0f}", f"{row.us_before:.1f}"]
        texts.append(text)
        last = row
    about = EXPLAINED.format(counted=COUNTED_CYCLES, cycles=cycles, seeds=seeds, cores=cores)
    if has_before:
        same = "the same" if all(row.is_same for row in rows) else "others"
        about += COMPARED.format(same=same).rstrip()
    return [*about.splitlines(), "", *table(head, texts)]


def figures(rows: list[Row]) -> list[dict[str, Any]]:
    return [{k: v for k, v in asdict(row).items() if v is not None} for row in rows]
