# SPDX-License-Identifier: MIT
"""Faults of the link, the host and a slave under the real ecdaqd: noticed, named, and OP again."""

from __future__ import annotations

import signal
import time
from collections.abc import Callable

import pytest
from bus import SECONDS, Bus
from segment import Segment, wait_for

HELD_MS = 300


@pytest.fixture
def bus(make_segment: Callable[..., Segment]) -> Bus:
    return Bus(make_segment())


@pytest.mark.parametrize("interface", ["ecsim0", "ecat0"], ids=["carrier lost", "down and up"])
def test_a_lost_link_is_named_and_the_bus_is_back_with_it(bus: Bus, interface: str) -> None:
    """ecsim0 down is the cable pulled out; ecat0 down is the master's own NIC."""
    bus.segment.space.run("ip", "link", "set", interface, "down")
    status = bus.wait_for_message("interface ecat0 has no link")
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
    start = time.monotonic()
    bus.segment.send("daemon", signal.SIGSTOP)
    wait_for("300 ms", lambda: time.monotonic() > start + HELD_MS / 1000, SECONDS)
    bus.segment.send("daemon", signal.SIGCONT)
    held_ms = (time.monotonic() - start) * 1000
    bus.wait_for_event("overrun")
    skipped = max(e["arg"][0] for e in bus.events("overrun"))
    assert HELD_MS - 50 <= skipped <= held_ms + 500
    # The watchdog of the slaves has expired meanwhile.
    assert bus.wait_for_event("slave_state", "SAFE-OP", "0x001b")["slave"] in (0, 1)
    bus.is_led_back()


def test_a_slave_without_power_is_named_and_back_with_it(bus: Bus) -> None:
    bus.fault("at=0s power-off slave=1")
    lost = bus.wait_for_event("slave_lost")
    assert lost["slave"] == 1
    status = bus.wait_for_message("slave 1 (piccolo1): does not answer")
    assert status["state"] == "RECOVERING"
    bus.fault("at=0s power-on slave=1")
    back = bus.wait_for_event("slave_back")
    assert back["slave"] == 1 and back["mono_ns"] > lost["mono_ns"]
    bus.is_led_back()
