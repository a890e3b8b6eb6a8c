# SPDX-License-Identifier: MIT
"""An ordered stop of the real ecdaqd: in time whatever is broken, and safe at the second Ctrl-C."""

from __future__ import annotations

import signal
import time
from collections.abc import Callable

from segment import Segment, wait_for

# These measure time, or need a cycle in time.
IDLE = True

# tests/sim checks on virtual time that a stop takes a second. Here: it waits for none of these.
PATIENT = {"bus.op_timeout": "120s", "bus.scan_timeout": "60s", "bus.mailbox_timeout": "60s"}
LIMIT_S = 30.0


def stop_in_time(segment: Segment, signals: int = 1) -> int:
    start = time.monotonic()
    process = segment.processes["daemon"]
    for _ in range(signals):
        process.send_signal(signal.SIGINT)
    code = process.wait(150)
    assert time.monotonic() - start < LIMIT_S
    return code


def test_a_cable_that_is_out_does_not_delay_the_stop(make_segment: Callable[..., Segment]) -> None:
    segment = make_segment(settings=PATIENT)
    segment.start_all()
    segment.space.run("ip", "link", "set", "ecsim0", "down")
    wait_for("RECOVERING", lambda: segment.status()["state"] == "RECOVERING", 30)
    stop_in_time(segment)


def test_the_scan_of_an_empty_wire_ends_at_once_and_as_told(
    make_segment: Callable[..., Segment],
) -> None:
    segment = make_segment(settings=PATIENT)
    segment.start_daemon()
    wait_for("SCANNING", lambda: segment.status().get("state") == "SCANNING", 30)
    assert stop_in_time(segment) == 0
    assert "no slave" not in segment.log("daemon")


def test_a_second_ctrl_c_does_not_cut_the_stop_short(make_segment: Callable[..., Segment]) -> None:
    segment = make_segment(settings=PATIENT)
    segment.start_all()
    assert stop_in_time(segment, signals=3) == 0
    assert segment.status()["state"] == "STOPPED"
