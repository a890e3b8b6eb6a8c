# SPDX-License-Identifier: MIT
"""The packet filter of a machine: its rules, and what passes them between two namespaces."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from conftest import TOP

PROGRAM = TOP / "recipes/recipes-core/ecdaq-config/files/root/usr/lib/ecdaq/firewall"
# Stands in for `ecdaq config show --json [OPTION...] FILE`; the file has the lines.
TOOL = """#!/bin/sh
for file; do :; done
sed 's/^\\([^ ]*\\) \\(.*\\)/{"option":"\\1","value":"\\2","unit":""}/' "$file"
"""
DDS = "dds.enable on\ndds.interface lan0\ndds.domain 7\n"
# A packet to each port, the closed ones first: what was dropped would have come before the rest.
PROBE = """
import socket, sys
address, tcp_closed, tcp_open, udp_closed, udp_open = sys.argv[1:]
closed = socket.socket(); closed.setblocking(False); closed.connect_ex((address, int(tcp_closed)))
udp = socket.socket(type=socket.SOCK_DGRAM)
udp.sendto(b"closed", (address, int(udp_closed))); udp.sendto(b"open", (address, int(udp_open)))
for port in tcp_open.split(","):
    socket.create_connection((address, int(port)), 60).close()
print("not answered" if closed.getsockopt(socket.SOL_SOCKET, socket.SO_ERROR) == 0 else "refused")
try:
    closed.getpeername(); print("connected")
except OSError:
    print("not connected")
"""
LISTEN = """
import socket, sys
tcp, udp_closed, udp_open = sys.argv[1:]
servers = [socket.create_server(("", int(port))) for port in tcp.split(",")]
quiet = socket.socket(type=socket.SOCK_DGRAM); quiet.bind(("", int(udp_closed)))
heard = socket.socket(type=socket.SOCK_DGRAM); heard.bind(("", int(udp_open)))
print("ready", flush=True)
print(heard.recv(100).decode(), flush=True)
quiet.setblocking(False)
try:
    print("closed port heard", quiet.recv(100))
except BlockingIOError:
    print("nothing else", flush=True)
sys.stdin.read()
"""


class Place:
    """A machine's settings, and its rules."""

    def __init__(self, base: Path) -> None:
        self.settings = base / "ecdaq.yaml"
        self.opened = base / "firewall"
        self.console = base / "console"
        (base / "ecdaq").write_text(TOOL)
        (base / "ecdaq").chmod(0o755)
        self.settings.write_text("dds.enable off\ngateway.listen off\n")
        self.console.touch()
        self.environment = os.environ | {
            "ECDAQ_CONFIGURATION": str(self.settings),
            "ECDAQ_FIREWALL_FILE": str(self.opened),
            "ECDAQ_PTP_DIR": str(base / "ptp"),
            "ECDAQ_TOOL": str(base / "ecdaq"),
            "ECDAQ_CONSOLE": str(self.console),
        }

    def rules(self) -> str:
        done = subprocess.run(
            [PROGRAM, "--print"], env=self.environment, capture_output=True, text=True, check=True
        )
        return done.stdout

    def accepted(self) -> set[str]:
        lines = (line.strip() for line in self.rules().splitlines())
        return {line for line in lines if "dport" in line and line.endswith(" accept")}


ALWAYS = {
    "udp dport 68 udp sport 67 accept",
    "ip6 saddr fe80::/10 udp dport 546 accept",
    "tcp dport 22 accept",
}


@pytest.fixture
def place(tmp_path: Path) -> Place:
    return Place(tmp_path)


def test_only_ssh_and_addresses_come_in_unless_configured(place: Place) -> None:
    assert place.accepted() == ALWAYS
    assert place.rules().count("policy drop;") == 2


def test_dds_is_open_on_its_interface_and_for_its_domain(place: Place) -> None:
    place.settings.write_text(DDS)
    assert place.accepted() - ALWAYS == {'iifname "lan0" udp dport 9150-9359 accept'}
    place.settings.write_text(DDS.replace("enable on", "enable off"))
    assert place.accepted() == ALWAYS


def test_a_gateway_for_others_is_open_and_one_for_this_machine_is_not(place: Place) -> None:
    place.settings.write_text("gateway.listen 10.0.0.1\ngateway.port 34980\n")
    assert place.accepted() - ALWAYS == {"meta l4proto { 6, 17 } th dport 34980 accept"}
    place.settings.write_text("gateway.listen loopback\ngateway.port 34980\n")
    assert place.accepted() == ALWAYS


def test_a_page_for_others_is_open_and_one_for_this_machine_is_not(place: Place) -> None:
    place.settings.write_text("web.enable on\nweb.listen 10.0.0.1\nweb.port 8765\n")
    assert place.accepted() - ALWAYS == {"tcp dport 8765 accept"}
    place.settings.write_text("web.enable on\nweb.listen loopback\nweb.port 8765\n")
    assert place.accepted() == ALWAYS
    place.settings.write_text("web.enable off\nweb.listen 10.0.0.1\nweb.port 8765\n")
    assert place.accepted() == ALWAYS


def test_ptp_over_udp_is_open_on_its_port_only(place: Place) -> None:
    folder = place.settings.parent / "ptp"
    folder.mkdir()
    (folder / "lan0.conf").write_text("[global]\nnetwork_transport L2\n[lan0]\n")
    assert place.accepted() == ALWAYS
    (folder / "lan0.conf").write_text("[global]\nnetwork_transport UDPv4\n[lan0]\n")
    assert place.accepted() - ALWAYS == {'iifname "lan0" udp dport 319-320 accept'}


def test_a_file_on_the_boot_partition_opens_ports(place: Place) -> None:
    place.opened.write_bytes(b"# a web server\r\ntcp 8080\r\n\nudp 5000-5010 eth1\ntcp 99")
    assert place.accepted() - ALWAYS == {
        "tcp dport 8080 accept",
        'iifname "eth1" udp dport 5000-5010 accept',
        "tcp dport 99 accept",
    }


@pytest.mark.parametrize(
    "line",
    [
        "icmp 3",
        "tcp",
        "tcp x",
        "tcp 0",
        "tcp 65536",
        "tcp 10-5",
        "tcp 1-",
        "tcp 80 lan0;drop",
        'tcp 80 "',
        "tcp 80 a-name-too-long-for-a-port",
        "tcp 80 lan0 tcp 81",
    ],
)
def test_a_wrong_line_is_reported_with_its_number_and_the_others_are_used(
    place: Place, line: str
) -> None:
    place.opened.write_text(f"tcp 8080\n{line}\ntcp 8081\n")
    assert place.accepted() - ALWAYS == {"tcp dport 8080 accept", "tcp dport 8081 accept"}
    (told,) = place.console.read_text().splitlines()
    assert told.startswith("ecdaq-firewall: firewall: line 2: ") and told.endswith(", ignored")


def test_settings_that_cannot_be_shown_leave_ssh_open_and_dds_closed(place: Place) -> None:
    place.settings.unlink()
    assert place.accepted() == ALWAYS
    assert "no settings: DDS stays closed" in place.console.read_text()


# Stands in for nft: keeps what it is given, and refuses so many of its first calls.
NFT = """#!/bin/sh
n=$(ls "$ECDAQ_RULES" | wc -l)
cat > "$ECDAQ_RULES/$n"
[ "$n" -ge "$ECDAQ_REFUSALS" ]
"""


def applied(place: Place, refusals: int = 0) -> tuple[int, list[str]]:
    """Exit code, and what nft was given."""
    folder = place.settings.parent
    (folder / "bin").mkdir()
    (folder / "bin/nft").write_text(NFT)
    (folder / "bin/nft").chmod(0o755)
    (folder / "rules").mkdir()
    environment = place.environment | {
        "PATH": f"{folder / 'bin'}:{os.environ['PATH']}",
        "ECDAQ_RULES": str(folder / "rules"),
        "ECDAQ_REFUSALS": str(refusals),
    }
    done = subprocess.run([PROGRAM], env=environment, capture_output=True, text=True, check=False)
    return done.returncode, [f.read_text() for f in sorted((folder / "rules").iterdir())]


def is_only_ssh(rules: str) -> bool:
    lines = {line.strip() for line in rules.splitlines()}
    return {x for x in lines if "dport" in x} == ALWAYS and rules.count("policy drop;") == 2


def test_rules_that_are_taken_are_set_once(place: Place) -> None:
    place.settings.write_text(DDS)
    code, given = applied(place)
    assert (code, given) == (0, [place.rules()])


def test_rules_that_are_refused_leave_ssh_alone_open(place: Place) -> None:
    place.settings.write_text(DDS)
    code, given = applied(place, refusals=1)
    assert code == 1
    assert len(given) == 2 and "9150-9359" in given[0] and is_only_ssh(given[1])
    assert "only SSH comes in" in place.console.read_text()


def test_rules_that_cannot_be_made_leave_ssh_alone_open(place: Place) -> None:
    place.settings.write_text(DDS.replace("domain 7", "domain 7x"))
    code, given = applied(place)
    assert code == 1
    assert len(given) == 1 and is_only_ssh(given[0])


def test_a_machine_without_a_packet_filter_says_so(place: Place) -> None:
    code, given = applied(place, refusals=2)
    assert (code, len(given)) == (1, 2)
    assert "no packet filter: every port is open" in place.console.read_text()


def test_the_unit_is_started_without_settings_too() -> None:
    """A filter that is not started leaves the machine open."""
    unit = (PROGRAM.parents[1] / "systemd/system/ecdaq-firewall.service").read_text()
    assert "Requires=" not in unit and "Requisite=" not in unit and "BindsTo=" not in unit
    assert "EnvironmentFile=-/run/" in unit
    assert "Before=network-pre.target" in unit and "Wants=network-pre.target" in unit


@pytest.fixture
def namespaces() -> Iterator[tuple[list[str], list[str]]]:
    """Outside and machine; the machine's port is lan0 with 10.99.0.2."""
    if os.geteuid() != 0 or not shutil.which("nft"):
        pytest.skip("needs root and nft")
    names = [f"ecdaq-{side}-{os.getpid()}" for side in ("outside", "machine")]
    for name in names:
        subprocess.run(["ip", "netns", "add", name], check=True)
    outside, machine = (["ip", "netns", "exec", name] for name in names)
    try:
        ends = ["lan0", "type", "veth", "peer", "lan0", "netns", names[0]]
        subprocess.run(["ip", "-n", names[1], "link", "add", *ends], check=True)
        for number, name in enumerate(names, 1):
            address = f"10.99.0.{number}/24"
            subprocess.run(["ip", "-n", name, "addr", "add", address, "dev", "lan0"], check=True)
            subprocess.run(["ip", "-n", name, "link", "set", "lan0", "up"], check=True)
        yield outside, machine
    finally:
        for name in names:
            subprocess.run(["ip", "netns", "del", name], check=True)


def test_packets_to_closed_ports_get_no_answer_and_others_arrive(
    place: Place, namespaces: tuple[list[str], list[str]]
) -> None:
    outside, machine = namespaces
    place.settings.write_text(DDS + "gateway.listen 10.99.0.2\ngateway.port 34980\n")
    place.opened.write_text("tcp 8080\n")
    # The image has no names of protocols and services.
    bare = "for f in protocols services; do mount --bind /dev/null /etc/$f; done; exec "
    command = [*machine, "unshare", "--mount", "sh", "-c", bare + str(PROGRAM)]
    for _ in range(2):  # set anew, they take the place of the old ones
        subprocess.run(command, env=place.environment, check=True)
    server = subprocess.Popen(
        [*machine, sys.executable, "-c", LISTEN, "22,8080,8081", "9360", "9359"],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    )
    assert server.stdin is not None and server.stdout is not None
    try:
        assert server.stdout.readline() == "ready\n"
        probe = [*outside, sys.executable, "-c", PROBE]
        done = subprocess.run(
            [*probe, "10.99.0.2", "8081", "22,8080", "9360", "9359"],
            capture_output=True,
            text=True,
            check=True,
        )
        assert done.stdout.splitlines() == ["not answered", "not connected"]
        assert server.stdout.readline() == "open\n"
        assert server.stdout.readline() == "nothing else\n"
    finally:
        server.stdin.close()
        server.wait(60)
