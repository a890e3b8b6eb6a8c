# SPDX-License-Identifier: MIT
"""Faults of the link, the host and a slave under the real ecdaqd: noticed, named, and OP again."""

from __future__ import annotations

import json
import signal
import socket
import time
from collections.abc import Callable
from typing import Any

import pytest
from segment import Segment, wait_for

# Until something is noticed or mended, on a loaded machine.
SECONDS = 60
CYCLES = 500
HELD_MS = 300


class Bus:
    """A segment in OP with a control socket, and what has happened in it since a fault."""

    def __init__(self, segment: Segment) -> None:
        self.segment = segment
        self.control = segment.folder / "control"
        segment.start_sim("--control", str(self.control))
        wait_for("control socket", self.control.exists, 30)
        segment.start_daemon()
        segment.wait_for_op()
        self.pid = segment.status()["pid"]
        self.seen = len(self.all_events())

    def all_events(self) -> list[dict[str, Any]]:
        return [
            json.loads(line) for line in self.segment.ecdaq("events", "--json").stdout.splitlines()
        ]

    def events(self, name: str) -> list[dict[str, Any]]:
        return [e for e in self.all_events()[self.seen :] if e["event"] == name]

    def fault(self, line: str) -> None:
        answer = self.segment.folder / "answer"
        with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as sock:
            sock.bind(str(answer))
            sock.settimeout(30)
            sock.sendto(line.encode(), str(self.control))
            assert sock.recv(256).decode().strip() == "ok"
        answer.unlink()

    def wait_for_event(self, name: str, *words: str) -> dict[str, Any]:
        def there() -> dict[str, Any] | None:
            fits = (e for e in self.events(name) if all(w in e["text"] for w in words))
            return next(fits, None)

        return wait_for(f"event {name} with {words}", there, SECONDS)

    def wait_for_message(self, words: str) -> dict[str, Any]:
        def told() -> dict[str, Any]:
            status = self.segment.status()
            return status if words in status["message"] else {}

        return wait_for(f"message with '{words}'", told, SECONDS)

    def is_led_back(self) -> None:
        """The same process is in OP again after it was not, and its samples are good again."""
        left = wait_for("way out of OP", lambda: self.changes("OP -> RECOVERING"), SECONDS)
        wait_for(
            "way back to OP",
            lambda: len(self.changes("RECOVERING -> OP")) >= len(self.changes("OP -> RECOVERING")),
            SECONDS,
        )
        assert self.changes("RECOVERING -> OP")[0]["mono_ns"] > left[0]["mono_ns"]
        good = self.segment.status()["samples_good"]
        wait_for(
            "good samples", lambda: self.segment.status()["samples_good"] >= good + CYCLES, SECONDS
        )
        status = self.segment.status()
        assert (status["pid"], status["link_up"]) == (self.pid, True)
        assert self.segment.stop("daemon") == 0

    def changes(self, text: str) -> list[dict[str, Any]]:
        return [e for e in self.events("bus_state") if text in e["text"]]


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
