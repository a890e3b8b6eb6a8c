# SPDX-License-Identifier: MIT
"""The recorder is stopped, killed, or out of room: what it loses is told; the bus goes on."""

from __future__ import annotations

import json
import os
import signal
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
from segment import Segment, Undisturbed, recorded, wait_for

# These measure time, or need a cycle in time.
IDLE = True
SHORT_RING = {"ring.depth": "2s"}
RING_CYCLES = 2048  # at 1 ms, rounded up to a power of two
SECONDS = 60


@dataclass
class Recording:
    """What the files say when all is over."""

    cycles: list[int]
    gap_events: list[Any]
    told_missing: int  # by the recorder's status page
    summary: dict[str, Any]
    check: dict[str, Any]
    check_exit: int

    def missing(self) -> list[tuple[int, int]]:
        """First cycle and number of cycles of each hole in what was recorded."""
        pairs = zip(self.cycles, self.cycles[1:], strict=False)
        return [(a + 1, b - a - 1) for a, b in pairs if b != a + 1]


def begin(make_segment: Callable[..., Segment], **arguments: object) -> Segment:
    segment = make_segment(**arguments)
    segment.start_all()
    wait_for("a recording", lambda: segment.status().get("recorded_cycles", 0) > 500, SECONDS)
    return segment


def end(segment: Segment) -> Recording:
    told_missing = segment.status()["recorder"]["cycles_missing"]
    assert segment.stop("daemon") == 0
    assert segment.stop("recorder") == 0
    events = [m for m in recorded(segment.record_dir, "/ecdaq/event") if m.name == "record_gap"]
    check = segment.ecdaq("log", "check", "--json", str(segment.record_dir), check=False)
    return Recording(
        [m.cycle for m in recorded(segment.record_dir, "/ecdaq/cycle")],
        events,
        told_missing,
        json.loads(segment.ecdaq("status", "--json", "--summary").stdout),
        json.loads(check.stdout),
        check.returncode,
    )


def nothing_is_missing(got: Recording) -> None:
    assert got.missing() == []
    assert got.gap_events == []
    assert (got.summary["recorded_cycles"], got.summary["recorded_gaps"]) == (len(got.cycles), 0)
    assert (got.check_exit, got.check["gaps"], got.check["cycles_missing"]) == (0, 0, 0)


def one_gap_is_told_exactly(got: Recording) -> tuple[int, int]:
    """By the files, the event in them, the status and `ecdaq log check`; first cycle and number."""
    [(first, count)] = got.missing()
    [event] = got.gap_events
    assert (event.value, event.arg0) == (first, count)
    assert f"{count} cycles from {first} on" in event.text
    assert (got.summary["recorded_cycles"], got.summary["recorded_gaps"]) == (len(got.cycles), 1)
    assert got.told_missing == count
    assert got.check_exit != 0
    assert (got.check["gaps"], got.check["cycles_missing"]) == (1, count)
    return first, count


def stop_for(segment: Segment, cycles: int) -> tuple[int, int]:
    """SIGSTOP while the bus makes so many cycles, which it does undisturbed. The number of the last
    cycle that may have been recorded before, and of one before SIGCONT."""
    undisturbed = Undisturbed(segment)
    recorder = segment.processes["recorder"].pid
    segment.send("recorder", signal.SIGSTOP)
    os.waitpid(recorder, os.WUNTRACED)
    stopped = segment.status()["cycle_number"]
    last = segment.wait_for_cycles(cycles, SECONDS)["cycle_number"]
    segment.send("recorder", signal.SIGCONT)
    undisturbed.check()
    return stopped, last


def test_a_recorder_stopped_for_less_than_the_ring_loses_nothing(
    make_segment: Callable[..., Segment],
) -> None:
    segment = begin(make_segment)
    stop_for(segment, 3000)
    segment.wait_for_cycles(500, SECONDS)
    nothing_is_missing(end(segment))


def test_a_recorder_stopped_for_longer_than_the_ring_tells_each_cycle_that_it_lost(
    make_segment: Callable[..., Segment],
) -> None:
    segment = begin(make_segment, settings=SHORT_RING)
    recorded_before = segment.status()["recorded_cycles"]
    stopped, last = stop_for(segment, 4 * RING_CYCLES)
    wait_for("gap in the status", lambda: segment.status()["recorded_gaps"] == 1, SECONDS)
    seen = segment.status()["cycle_number"]
    segment.wait_for_cycles(500, SECONDS)
    got = end(segment)
    first, count = one_gap_is_told_exactly(got)
    # What was recorded before is in the files; what the ring had after it, too.
    assert got.cycles[0] + recorded_before <= first <= stopped + 1
    assert last - RING_CYCLES < first + count <= seen


def test_a_recorder_killed_for_longer_than_the_ring_tells_each_cycle_that_it_lost(
    make_segment: Callable[..., Segment],
) -> None:
    segment = begin(make_segment, settings=SHORT_RING)
    assert segment.stop("recorder", signal.SIGKILL) == -signal.SIGKILL
    undisturbed = Undisturbed(segment)
    segment.wait_for_cycles(4 * RING_CYCLES, SECONDS)
    undisturbed.check()
    segment.start_recorder()
    wait_for("gap in the status", lambda: segment.status()["recorded_gaps"] == 1, SECONDS)
    segment.wait_for_cycles(500, SECONDS)
    [(first, count)] = (got := end(segment)).missing()
    assert f"{count} cycles from {first} on" in got.gap_events[0].text
    assert (got.check["gaps"], got.check["cycles_missing"]) == (1, count)


@pytest.mark.skipif(os.geteuid() != 0, reason="needs root to mount a small file system")
def test_a_recorder_without_room_goes_on_when_there_is_some_and_tells_what_it_lost(
    make_segment: Callable[..., Segment],
) -> None:
    segment = make_segment(
        settings=SHORT_RING
        | {"record.reserve": "1MiB", "record.compression": "0", "record.when_full": "stop"}
    )
    segment.record_dir.mkdir()
    segment.space.run("mount", "-t", "tmpfs", "-o", "size=16m", "none", str(segment.record_dir))
    filler = segment.record_dir / "filler"
    segment.space.run("fallocate", "-l", "13MiB", str(filler))
    segment.start_all()
    undisturbed = Undisturbed(segment)
    wait_for(
        "the alarm",
        lambda: "disk" in segment.status().get("recorder", {}).get("state", ""),
        SECONDS,
    )
    stopped = segment.status()["cycle_number"]
    last = segment.wait_for_cycles(4 * RING_CYCLES, SECONDS)["cycle_number"]
    undisturbed.check()
    segment.space.run("rm", str(filler))
    wait_for("gap in the status", lambda: segment.status()["recorded_gaps"] == 1, SECONDS)
    segment.wait_for_cycles(500, SECONDS)
    # The file system is that of the namespace; this is the way into it from here.
    segment.record_dir = Path(f"/proc/{segment.space.holder.pid}/root{segment.record_dir}")
    first, count = one_gap_is_told_exactly(end(segment))
    assert first <= stopped + 1
    assert first + count > last - RING_CYCLES
