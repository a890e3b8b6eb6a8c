# SPDX-License-Identifier: MIT
"""The mailbox gateway with a client of its own, beside a bus in OP."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from bus import Bus
from segment import Segment, Undisturbed

CLIENT = Path(__file__).with_name("gateway_client.py")
PICCOLO, AKD = 0x1001, 0x1003
AKD_MAIL_BYTES = 1024
NAME = b"AKD EtherCAT Drive (CoE)".hex()
UNSUPPORTED_PROTOCOL, INVALID_HEADER = 2, 5
NO_SUCH_OBJECT = 0x06020000


class Clients:
    """A bus with a gateway, and clients in its namespace."""

    def __init__(self, segment: Segment) -> None:
        segment.space.run("ip", "link", "set", "lo", "up")
        self.bus = Bus(segment)
        self.segment = segment
        self.undisturbed = Undisturbed(segment)

    def command(self, *arguments: str | int) -> list[str]:
        return [*self.segment.space.enter, sys.executable, str(CLIENT), *map(str, arguments)]

    def start(self, *arguments: str | int) -> subprocess.Popen[str]:
        return subprocess.Popen(self.command(*arguments), stdout=subprocess.PIPE, text=True)

    def result(self, client: subprocess.Popen[str]) -> dict[str, Any]:
        out, _ = client.communicate(timeout=120)
        assert client.returncode == 0
        return json.loads(out)

    def run(self, *arguments: str | int) -> dict[str, Any]:
        return self.result(self.start(*arguments))

    def check_undisturbed(self) -> None:
        """And no sample is lost for a reason that is not in the sample."""
        self.undisturbed.check()


@pytest.fixture
def clients(make_segment: Callable[..., Segment]) -> Clients:
    settings = {"gateway.listen": "loopback"}
    return Clients(make_segment(slaves="fb1111_piccolo,fb1111_piccolo,akd", settings=settings))


@pytest.mark.parametrize("kind", ["udp", "tcp"])
def test_objects_and_files_pass_the_gateway_beside_an_undisturbed_cycle(
    clients: Clients, kind: str
) -> None:
    assert clients.run(kind, AKD, "upload", 0x1008, 0, 20) == {"values": [NAME]}
    assert clients.run(kind, PICCOLO, "upload", 0x1018, 1, 1) == {"values": ["02000000"]}
    copied = clients.run(kind, AKD, "file", "a.bin", 30000, AKD_MAIL_BYTES)
    assert copied == {"same": True, "again": True}
    clients.check_undisturbed()


def test_what_cannot_be_answered_is_refused(clients: Clients) -> None:
    assert clients.run("udp", 0, "upload", 0x1008, 0, 1) == {"refused": NO_SUCH_OBJECT}
    assert clients.run("udp", 0x4444, "upload", 0x1008, 0, 1) == {"refused": INVALID_HEADER}
    refused = clients.run("tcp", PICCOLO, "ip", "020000000001", "10.9.8.7", "255.0.0.0")
    assert refused == {"refused": UNSUPPORTED_PROTOCOL}
    clients.check_undisturbed()


def test_several_clients_and_ecdaq_get_their_own_answers(clients: Clients) -> None:
    files = [
        clients.start(kind, AKD, "file", name, 8000, AKD_MAIL_BYTES)
        for kind, name in (("udp", "a.bin"), ("tcp", "b.bin"))
    ]
    uploads = [clients.start(kind, AKD, "upload", 0x1008, 0, 30) for kind in ("udp", "tcp")]
    for _ in range(5):
        got = clients.segment.ecdaq("sdo", "read", "2", "0x1018:1", "--json")
        assert json.loads(got.stdout)["value"] == 0x6A
    assert [clients.result(c) for c in files] == [{"same": True, "again": True}] * 2
    assert [clients.result(c) for c in uploads] == [{"values": [NAME]}] * 2
    clients.check_undisturbed()


def test_a_slave_that_does_not_answer_costs_only_its_own_clients(clients: Clients) -> None:
    clients.bus.fault("at=0s mailbox-stuck slave=2")
    dead = clients.start("udp", AKD, "upload", 0x1008, 0, 1)
    assert clients.run("tcp", PICCOLO, "upload", 0x1018, 1, 20) == {"values": ["02000000"]}
    assert dead.poll() is None
    assert clients.result(dead) == {"silent": True}
    event = clients.bus.wait_for_event("gateway_lost", "1 mails not answered by the slave")
    assert event["severity"] == "notice"
    clients.check_undisturbed()


def test_clients_that_send_rubbish_are_disconnected(clients: Clients) -> None:
    assert clients.run("tcp", AKD, "babble", 40) == {"closed": 40}
    assert clients.run("tcp", AKD, "upload", 0x1008, 0, 1) == {"values": [NAME]}
    clients.check_undisturbed()


def test_the_gateway_is_off_unless_it_is_configured(make_segment: Callable[..., Segment]) -> None:
    segment = make_segment(slaves="akd")
    segment.space.run("ip", "link", "set", "lo", "up")
    Bus(segment)
    command = [sys.executable, str(CLIENT), "tcp", str(AKD), "upload", "0x1008", "0", "1"]
    got = segment.space.run(*command, check=False)
    assert "ConnectionRefusedError" in got.stderr
