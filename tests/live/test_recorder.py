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
from segment import Segment, recorded, wait_for

# 1024 samples at 1 ms.
SHORT_RING = {"ring.depth": "1s"}
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


def bus_events(segment: Segment) -> list[str]:
    lines = segment.ecdaq("events", "--json").stdout.splitlines()
    return [e["text"] for e in map(json.loads, lines) if e["event"] == "bus_state"]


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


def one_gap_is_told_exactly(got: Recording) -> int:
    """By the files, the event in them, the status and `ecdaq log check`; how many are missing."""
    [(first, count)] = got.missing()
    [event] = got.gap_events
    assert (event.value, event.arg0) == (first, count)
    assert f"{count} cycles from {first} on" in event.text
    assert (got.summary["recorded_cycles"], got.summary["recorded_gaps"]) == (len(got.cycles), 1)
    assert got.told_missing == count
    assert got.check_exit != 0
    assert (got.check["gaps"], got.check["cycles_missing"]) == (1, count)
    return count


def stop_for(segment: Segment, cycles: int) -> int:
    """SIGSTOP while the bus makes so many cycles; how many they were. It is not disturbed by it."""
    before, states = segment.status(), bus_events(segment)
    segment.send("recorder", signal.SIGSTOP)
    after = segment.wait_for_cycles(cycles, SECONDS)
    segment.send("recorder", signal.SIGCONT)
    assert after["state"] == "OP"
    assert bus_events(segment) == states
    assert after["samples_bad_unexplained"] == 0
    return after["cycles"] - before["cycles"]


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
    stopped = stop_for(segment, 4000)
    wait_for("gap in the status", lambda: segment.status()["recorded_gaps"] == 1, SECONDS)
    segment.wait_for_cycles(500, SECONDS)
    # All but what the ring still had when it went on.
    assert stopped - 1024 - 500 <= one_gap_is_told_exactly(end(segment)) <= stopped


def test_a_recorder_killed_for_longer_than_the_ring_tells_each_cycle_that_it_lost(
    make_segment: Callable[..., Segment],
) -> None:
    segment = begin(make_segment, settings=SHORT_RING)
    assert segment.stop("recorder", signal.SIGKILL) == -signal.SIGKILL
    states = bus_events(segment)
    segment.wait_for_cycles(4000, SECONDS)
    assert bus_events(segment) == states
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
        settings=SHORT_RING | {"record.reserve": "1MiB", "record.compression": "0"}
    )
    segment.record_dir.mkdir()
    segment.space.run("mount", "-t", "tmpfs", "-o", "size=16m", "none", str(segment.record_dir))
    filler = segment.record_dir / "filler"
    segment.space.run("fallocate", "-l", "13MiB", str(filler))
    segment.start_all()
    states = bus_events(segment)
    wait_for(
        "the alarm",
        lambda: "disk" in segment.status().get("recorder", {}).get("state", ""),
        SECONDS,
    )
    after = segment.wait_for_cycles(4000, SECONDS)
    assert (after["state"], bus_events(segment)) == ("OP", states)
    segment.space.run("rm", str(filler))
    wait_for("gap in the status", lambda: segment.status()["recorded_gaps"] == 1, SECONDS)
    segment.wait_for_cycles(500, SECONDS)
    # The file system is that of the namespace; this is the way into it from here.
    segment.record_dir = Path(f"/proc/{segment.space.holder.pid}/root{segment.record_dir}")
    assert one_gap_is_told_exactly(end(segment)) > 4000 - 1024 - 500
