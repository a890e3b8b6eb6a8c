# SPDX-License-Identifier: MIT
"""A segment in OP that can be given faults, and what has happened in it since."""

from __future__ import annotations

import json
import socket
from pathlib import Path
from typing import Any

from segment import Segment, wait_for

# Until something is noticed or repaired, on a loaded machine.
SECONDS = 60
CYCLES = 500


def tell(control: Path, line: str) -> str:
    """One line to the control socket of the segment; its answer."""
    answer = control.with_name("answer")
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as sock:
        sock.bind(str(answer))
        sock.settimeout(30)
        sock.sendto(line.encode(), str(control))
        said = sock.recv(4096).decode().strip()
    answer.unlink()
    return said


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
        assert tell(self.control, line) == "ok"

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
