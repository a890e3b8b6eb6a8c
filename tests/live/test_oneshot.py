# SPDX-License-Identifier: MIT
"""One-shot mode end to end: commanded at the master, fired by the slave, checked by its pulse."""

from __future__ import annotations

import json
import signal
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

from segment import Segment, Undisturbed, recorded, wait_for
from test_sync0 import Checked

# These measure time, or need a cycle in time.
IDLE = True
SLAVE, OTHER = 1, 0
# Far enough ahead for a refresh of the slave's outputs, on a busy machine, too.
AHEAD = "500ms"
MS = 1_000_000
MODES = {"slaves[0].mode": "periodic", "slaves[1].mode": "oneshot"}


def make(make_segment: Callable[..., Segment]) -> Checked:
    checked = Checked(make_segment(settings=MODES))
    checked.wait_for_windows(1)
    return checked


def judge(make_segment: Callable[..., Segment], shoot: Callable[[Checked], None]) -> None:
    """A slave that this machine made leave OP does not fire: then once more, with a new segment."""
    for attempt in range(3):
        checked = make(make_segment)
        undisturbed = Undisturbed(checked.segment)
        try:
            shoot(checked)
            return
        except (AssertionError, subprocess.CalledProcessError):
            if attempt == 2 or undisturbed.left() == undisturbed.left_before:
                raise


def fire(checked: Checked, ahead: str = AHEAD, *more: str) -> int:
    """Arm the slave; the DC time at which SYNC0 is to come."""
    message = checked.segment.ecdaq("oneshot", str(SLAVE), "--in", ahead, "--json", *more)
    at: int = json.loads(message.stdout)["dc_time_ns"]
    return at


def wait_for_events(checked: Checked, event: str, count: int = 1) -> list[dict[str, Any]]:
    def enough() -> list[dict[str, Any]]:
        found = [e for e in checked.events() if e["event"] == event]
        return found if len(found) >= count else []

    return wait_for(f"{count} {event}", enough, 120)


def shots(checked: Checked) -> list[dict[str, Any]]:
    """All events of shots, and of pulses without a command."""
    return [e for e in checked.events() if e["slave"] == SLAVE]


def pulses(edges: Path) -> list[int]:
    """DC times of the slave's own pulses."""
    lines = edges.read_text().splitlines()[:-1]
    return [int(line.split()[2]) for line in lines if line.startswith(f"{SLAVE} ")]


def test_a_shot_is_timed_against_its_command_and_a_missing_one_is_reported(
    make_segment: Callable[..., Segment],
) -> None:
    judge(make_segment, shots_and_a_missing_one)


def shots_and_a_missing_one(checked: Checked) -> None:
    segment = checked.segment
    segment.start_recorder()
    came = fire(checked, AHEAD, "--wait")
    (event,) = wait_for_events(checked, "sync0_shot")
    assert (event["slave"], event["value"]) == (SLAVE, came)
    late, bound = event["arg"]
    # The pulse is exact; the reported deviation is the error of the clocks' map.
    assert came in pulses(checked.edges)
    assert abs(late) <= bound < MS
    line = checked.report()["lines"][SLAVE]
    assert (line["oneshot"], line["shots"], line["shots_lost"]) == (True, 1, 0)
    assert line["shot"]["came"] is True and line["shot"]["dc_time_ns"] == came
    assert abs(line["shot"]["late_ns"] - late) <= 1

    checked.fault(f"at=0s sync0-lost slave={SLAVE} count=1")
    lost = fire(checked)
    (event,) = wait_for_events(checked, "sync0_shot_lost")
    assert (event["slave"], event["value"]) == (SLAVE, lost)
    line = checked.report()["lines"][SLAVE]
    assert (line["shots"], line["shots_lost"], line["verdict"]) == (2, 1, "FAIL")
    assert f"shot for DC time {lost} did not come" in segment.ecdaq("sync0").stdout
    assert lost not in pulses(checked.edges)

    again = fire(checked)
    assert [e["value"] for e in wait_for_events(checked, "sync0_shot", 2)] == [came, again]
    assert [e["event"] for e in shots(checked)] == ["sync0_shot", "sync0_shot_lost", "sync0_shot"]
    # The slave beside it is periodic, and none of its pulses is missing.
    assert checked.report()["lines"][OTHER]["missing"] == 0
    segment.stop("sync0")
    segment.stop("daemon")
    assert segment.stop("recorder") == 0
    kept = [m for m in recorded(segment.record_dir, "/ecdaq/sync0") if m.slave == SLAVE]
    assert [(m.shot_dc_ns, m.missing) for m in kept] == [(came, 0), (lost, 1), (again, 0)]


def test_another_command_cancels_a_shot_and_a_check_that_starts_late_reports_nothing(
    make_segment: Callable[..., Segment],
) -> None:
    judge(make_segment, a_cancelled_shot_and_a_late_check)


def a_cancelled_shot_and_a_late_check(checked: Checked) -> None:
    segment = checked.segment
    cancelled = fire(checked, "30s")
    first = fire(checked, AHEAD, "--wait")
    wait_for_events(checked, "sync0_shot")
    # No check runs for this one, which is still in the ring of the master.
    segment.stop("sync0", signal.SIGKILL)
    unchecked = fire(checked, AHEAD, "--wait")
    wait_for("its pulse", lambda: unchecked in pulses(checked.edges), 60)
    # And this one was commanded before the check began, to come when it listens.
    last = fire(checked, "10s")
    checked.start_check()
    pid = segment.processes["sync0"].pid
    wait_for("the second check", lambda: checked.report().get("pid") == pid, 60)
    assert [e["value"] for e in wait_for_events(checked, "sync0_shot")] == [last]
    assert [e["event"] for e in shots(checked)] == ["sync0_shot"]
    assert pulses(checked.edges) == [first, unchecked, last]
    assert cancelled not in pulses(checked.edges)
