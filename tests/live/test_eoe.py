# SPDX-License-Identifier: MIT
"""EoE through a TAP device of a network namespace, to the endpoints of simulated drives."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path

import pytest
from segment import Segment, wait_for
from test_gateway import Clients

PING = Path(__file__).with_name("ping.py")
TAP = "ecdaq0"
DRIVES = {1: "192.168.7.1", 2: "192.168.7.2"}
HOST = "192.168.7.254/24"


def ping(segment: Segment, address: str, count: int, size: int = 56, seconds: int = 20) -> int:
    """Answers, each within @seconds: none is lost, but on a busy machine one may take long."""
    words = [address, str(count), str(size), str(seconds)]
    got = segment.space.run(sys.executable, str(PING), *words)
    return int(got.stdout)


@pytest.fixture
def clients(make_segment: Callable[..., Segment]) -> Clients:
    settings = {"gateway.listen": "loopback", "eoe.interface": TAP}
    clients = Clients(make_segment(slaves="fb1111_piccolo,akd,akd", settings=settings))
    for pos, address in DRIVES.items():
        mac = f"0200000000{pos:02x}"
        assert clients.run("udp", 0x1001 + pos, "ip", mac, address, "255.255.255.0") == {}
    space = clients.segment.space
    space.run("sysctl", "-qw", f"net.ipv6.conf.{TAP}.disable_ipv6=1", check=False)
    space.run("ip", "address", "add", HOST, "dev", TAP)
    space.run("ip", "link", "set", TAP, "up")
    return clients


def test_drives_answer_pings_beside_an_undisturbed_cycle(clients: Clients) -> None:
    for address in DRIVES.values():
        assert ping(clients.segment, address, 20) == 20
        # In two fragments each: the drives' mailboxes have 1024 bytes.
        assert ping(clients.segment, address, 5, 1400) == 5
    clients.check_undisturbed()


def test_a_slave_whose_frames_never_end_disturbs_no_other(clients: Clients) -> None:
    clients.bus.fault("at=0s mailbox kind=eoe slave=1 count=50")
    assert clients.run("udp", 0x1002, "upload", 0x1018, 1, 20) == {"values": ["6a000000"]}
    assert ping(clients.segment, DRIVES[2], 10) == 10
    clients.check_undisturbed()


def test_a_slave_that_takes_no_mails_loses_its_frames_only(clients: Clients) -> None:
    assert ping(clients.segment, DRIVES[1], 1) == 1
    clients.bus.fault("at=0s mailbox-stuck slave=1")
    assert ping(clients.segment, DRIVES[1], 2, seconds=1) == 0
    assert ping(clients.segment, DRIVES[2], 10) == 10
    clients.check_undisturbed()


def test_a_deleted_interface_is_not_polled_for_ever(clients: Clients) -> None:
    segment = clients.segment
    segment.space.run("ip", "link", "delete", TAP)
    pid = segment.status()["pid"]

    def used() -> int:
        fields = Path(f"/proc/{pid}/task/{pid}/stat").read_text().rpartition(")")[2].split()
        return int(fields[11]) + int(fields[12])

    before = used()
    segment.wait_for_cycles(3000, 60)
    assert used() - before < 150, "of 300 ticks of the service thread"
    clients.check_undisturbed()


def test_the_interface_of_the_segment_is_no_eoe_interface(
    make_segment: Callable[..., Segment],
) -> None:
    segment = make_segment(slaves="akd", settings={"eoe.interface": "lo"})
    segment.start_sim()
    segment.start_daemon()
    daemon = segment.processes["daemon"]
    wait_for("end", lambda: daemon.poll() is not None, 30)
    assert "eoe.interface: lo: Invalid argument" in segment.log("daemon")
    assert daemon.returncode == 3
