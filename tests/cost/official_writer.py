# SPDX-License-Identifier: MIT
"""The recorder beside the official MCAP writer for Rust: the same messages, the same compression.

The recorder reads the sample ring, makes the messages and writes them; the other writer has them
ready in memory. There is no package of the official C++ writer.
"""

from __future__ import annotations

import os
import re
import statistics
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

from counting import PLAIN_PROCESSOR, Profile, count
from mcap.reader import make_reader

ROOT = Path(__file__).resolve().parents[2]
SOURCE = ROOT / "tests" / "bench" / "mcap_writer"
sys.path.insert(0, str(ROOT / "app" / "tools"))
from foreign import Unavailable, build_cargo, kept, need  # noqa: E402

# What is counted, and what is timed: so that a run takes some seconds at most.
COUNTED_CYCLES = 1000
TIMED_MESSAGES = 400_000
SETTLE_CYCLES = 2000
ROUNDS = 5


@dataclass(frozen=True)
class Bus:
    """What is recorded."""

    slaves: int
    channels: int  # of each slave


BUSES = (Bus(2, 6), Bus(64, 6), Bus(64, 16))


def build(out: Path) -> Path:
    return build_cargo(SOURCE, out, "mcap_writer", "--release")


def official_writer() -> Path:
    """Unavailable with the reason."""
    return kept(SOURCE, "mcap_writer", need("cargo", "cargo-web or cargo"), build)


def figure(text: str, unit: str) -> int:
    found = re.search(rf"(\d+) {unit}", text)
    if found is None:
        raise RuntimeError(f"no {unit} in {text!r}")
    return int(found[1])


def run(*command: str | Path | int, env: dict[str, str] | None = None) -> str:
    ended = subprocess.run(
        list(map(str, command)), env=os.environ | (env or {}), capture_output=True, text=True
    )
    if ended.returncode != 0:
        raise RuntimeError(f"{command[0]}: {ended.returncode}\n{ended.stdout}{ended.stderr}")
    return ended.stdout


def record(folder: Path, bus: Bus, cycles: int) -> tuple[Path, str]:
    """The recorder's file and what cost_record printed."""
    program = Path(os.environ["ECDAQ_BUILD"]) / "tests" / "cost" / "cost_record"
    text = run(program, folder, str(bus.slaves), str(cycles), str(bus.channels))
    (path,) = (folder / "records").glob("*.mcap")
    return path, text


def chunk_bytes(recording: Path) -> int:
    """Mean size of a chunk before compression."""
    with recording.open("rb") as stream:
        summary = make_reader(stream).get_summary()
    assert summary is not None
    return round(statistics.mean(c.uncompressed_size for c in summary.chunk_indexes))


def counted(writer: Path, bus: Bus) -> tuple[float, float]:
    """Instructions of a cycle, of the recorder and of the other writer."""
    ours = count("record", bus.slaves, COUNTED_CYCLES, bus.channels).instructions
    with tempfile.TemporaryDirectory(prefix="ecdaq-cost-", dir="/dev/shm") as folder:
        recording, _ = record(Path(folder), bus, COUNTED_CYCLES)
        profile = Path(folder) / "profile"
        words = ["valgrind", "--tool=callgrind", f"--callgrind-out-file={profile}"]
        words += ["--compress-pos=no", "--toggle-collect=counted", writer, recording]
        words += [Path(folder) / "other", chunk_bytes(recording)]
        run(*words, env={"GLIBC_TUNABLES": PLAIN_PROCESSOR})
        theirs = Profile(profile.read_text()).total
    return ours / COUNTED_CYCLES, theirs / (COUNTED_CYCLES + SETTLE_CYCLES)


def timed(writer: Path, bus: Bus) -> tuple[float, float]:
    """ns of a cycle, one right after the other."""
    cycles = TIMED_MESSAGES // (bus.slaves + 1)
    with tempfile.TemporaryDirectory(prefix="ecdaq-cost-", dir="/dev/shm") as folder:
        recording, text = record(Path(folder), bus, cycles)
        other = run(writer, recording, Path(folder) / "other", chunk_bytes(recording))
    return figure(text, "ns") / cycles, figure(other, "ns") / (cycles + SETTLE_CYCLES)


HEAD = ["slaves", "channels", "instructions", "official", "ratio", "us of CPU", "official"]
HEAD += ["ratio", "of the rounds", "million slave samples a s of CPU"]


def row_of(writer: Path, bus: Bus) -> list[str]:
    ours, theirs = counted(writer, bus)
    pairs = [timed(writer, bus) for _ in range(ROUNDS)]
    ratios = [a / b for a, b in pairs]
    ours_ns, theirs_ns = (statistics.median(values) for values in zip(*pairs, strict=True))
    return [
        str(bus.slaves),
        str(bus.channels),
        f"{ours:.0f}",
        f"{theirs:.0f}",
        f"{ours / theirs:.2f}",
        f"{ours_ns / 1000:.2f}",
        f"{theirs_ns / 1000:.2f}",
        f"{statistics.median(ratios):.2f}",
        f"{min(ratios):.2f} to {max(ratios):.2f}",
        f"{bus.slaves / ours_ns * 1000:.2f}",
    ]


def table() -> list[list[str]]:
    """A row for each bus; none, with the reason printed, where the other writer cannot be built."""
    try:
        writer = official_writer()
    except Unavailable as why:
        print(f"not measured: {why}")
        return []
    return [row_of(writer, bus) for bus in BUSES]
