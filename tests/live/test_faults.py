# SPDX-License-Identifier: MIT
"""Faults of the link, the host and a slave under the real ecdaqd: noticed, named, and OP again."""

from __future__ import annotations

import os
import signal
import time
from collections.abc import Callable
from typing import Any

import pytest
from bus import SECONDS, Bus
from segment import Segment, wait_for

# These measure time, or need a cycle in time.
IDLE = True
HELD_MS = 300
NS_PER_MS = 1_000_000


@pytest.fixture
def bus(make_segment: Callable[..., Segment]) -> Bus:
    return Bus(make_segment())


@pytest.mark.parametrize("interface", ["ecsim0", "ecat0"], ids=["carrier lost", "down and up"])
def test_a_lost_link_is_named_and_the_bus_is_back_with_it(bus: Bus, interface: str) -> None:
    """ecsim0 down is the cable pulled out; ecat0 down is the master's own NIC."""
    bus.segment.space.run("ip", "link", "set", interface, "down")
    bus.wait_for_message("interface ecat0 has no link")
    status = bus.segment.status()
    assert (status["link_up"], status["state"]) == (False, "RECOVERING")
    assert bus.wait_for_event("link", "down")["severity"] == "warning"
    bus.segment.space.run("ip", "link", "set", interface, "up")
    bus.wait_for_event("link", "up")
    bus.is_led_back()


def test_an_interface_that_was_deleted_and_made_anew_is_used_again(bus: Bus) -> None:
    space = bus.segment.space
    bus.segment.stop("sim")
    space.run("ip", "link", "delete", "ecat0")
    bus.wait_for_message("interface ecat0 has no link")
    space.make_link()
    bus.segment.start_sim("--control", str(bus.control))
    bus.wait_for_event("link", "up")
    bus.is_led_back()


def test_a_master_held_up_for_300_ms_tells_how_long_and_leads_the_slaves_back(bus: Bus) -> None:
    start_ns = time.monotonic_ns()
    bus.segment.send("daemon", signal.SIGSTOP)
    # Then all its threads are stopped.
    os.waitpid(bus.pid, os.WUNTRACED)
    stopped_ns = time.monotonic_ns()
    wait_for("300 ms", lambda: time.monotonic_ns() > stopped_ns + HELD_MS * NS_PER_MS, SECONDS)
    continued_ns = time.monotonic_ns()
    bus.segment.send("daemon", signal.SIGCONT)

    def after_it() -> list[dict[str, Any]]:
        return [e for e in bus.events("overrun") if e["mono_ns"] >= continued_ns]

    event = wait_for("overrun", after_it, SECONDS)[0]
    # A cycle each millisecond: those of the stop, and of the time around it until this was noted.
    skipped_ns = event["arg"][0] * NS_PER_MS
    assert skipped_ns >= continued_ns - stopped_ns - 2 * NS_PER_MS
    assert skipped_ns <= event["mono_ns"] - start_ns + 2 * NS_PER_MS
    # The watchdog of the slaves has expired meanwhile.
    assert bus.wait_for_event("slave_state", "SAFE-OP", "0x001b")["slave"] in (0, 1)
    bus.is_led_back()


def test_a_slave_without_power_is_named_and_back_with_it(bus: Bus) -> None:
    bus.fault("at=0s power-off slave=1")
    lost = bus.wait_for_event("slave_lost", "slave 1: ")
    bus.wait_for_message("slave 1 (piccolo1): does not answer")
    assert bus.segment.status()["state"] == "RECOVERING"
    bus.fault("at=0s power-on slave=1")
    back = bus.wait_for_event("slave_back", "slave 1: ")
    assert back["mono_ns"] > lost["mono_ns"]
    bus.is_led_back()
