# SPDX-License-Identifier: MIT
"""Name servers and time servers from networkd's state, for libc and chrony, on made-up folders."""

from __future__ import annotations

import os
import subprocess
from pathlib import Path

import pytest
from conftest import TOP

PROGRAM = TOP / "recipes/recipes-core/ecdaq-config/files/root/usr/lib/ecdaq/net-names"
STATE = """# This is private data. Do not parse.
OPER_STATE=routable
DNS=192.0.2.53 2001:db8::53 fe80::1%lan0
NTP=ntp.example 192.0.2.123
DOMAINS=example
"""


class Place:
    """Folders in place of those of a machine; chronyc notes what it was asked."""

    def __init__(self, base: Path) -> None:
        self.base = base
        self.state = base / "state"
        self.names = base / "names"
        self.sources = base / "sources"
        self.own = base / "boot.sources"
        self.asked = base / "asked"
        self.names.mkdir()
        self.sources.mkdir()
        self.chronyc("exit 0")

    def chronyc(self, end: str) -> None:
        program = self.base / "chronyc"
        program.write_text(f'#!/bin/sh\necho "$*" >> {self.asked}\n{end}\n')
        program.chmod(0o755)

    def run(self, state: str | None) -> None:
        if state is not None:
            self.state.write_text(state)
        self.asked.write_text("")
        environment = os.environ | {
            "ECDAQ_NETIF_STATE": str(self.state),
            "ECDAQ_NAMES_DIR": str(self.names),
            "ECDAQ_SOURCES_DIR": str(self.sources),
            "ECDAQ_OWN_SOURCES": str(self.own),
            "ECDAQ_CHRONYC": str(self.base / "chronyc"),
        }
        subprocess.run([PROGRAM], env=environment, check=True)

    def resolv_conf(self) -> str:
        return (self.names / "resolv.conf").read_text()

    def time_sources(self) -> str:
        return (self.sources / "network.sources").read_text()


@pytest.fixture
def place(tmp_path: Path) -> Place:
    return Place(tmp_path)


def test_name_servers_of_the_network_are_those_of_libc(place: Place) -> None:
    place.run(STATE)
    assert place.resolv_conf().splitlines() == [
        "nameserver 192.0.2.53",
        "nameserver 2001:db8::53",
        "nameserver fe80::1%lan0",
    ]


def test_time_servers_of_the_network_are_those_of_chrony_by_name_too(place: Place) -> None:
    place.run(STATE)
    assert place.time_sources() == "server ntp.example iburst\nserver 192.0.2.123 iburst\n"
    assert place.asked.read_text().splitlines() == ["reload sources", "refresh"]


def test_time_servers_of_the_boot_partition_take_their_place(place: Place) -> None:
    place.own.write_text("server 192.0.2.1 iburst\n")
    place.run(STATE)
    assert place.time_sources() == ""


def test_chrony_is_told_of_changes_only(place: Place) -> None:
    place.run(STATE)
    place.run(STATE)
    assert place.asked.read_text() == ""
    place.run(STATE.replace("192.0.2.123", "192.0.2.124"))
    assert "reload sources" in place.asked.read_text()


def test_chrony_that_does_not_run_yet_is_told_later(place: Place) -> None:
    place.chronyc("exit 1")
    place.run(STATE)
    place.chronyc("exit 0")
    place.run(STATE)
    assert "reload sources" in place.asked.read_text()


@pytest.mark.parametrize("state", [None, "", "OPER_STATE=off\nDNS=\nNTP=\n"])
def test_a_machine_without_a_network_has_no_servers(place: Place, state: str | None) -> None:
    place.run(state)
    assert place.resolv_conf() == ""
    assert place.time_sources() == ""


def test_what_is_no_name_and_no_address_is_left_out(place: Place) -> None:
    long = "x" * 300
    place.run(f"DNS=$(reboot) 1.1.1.1#dns.example a.b;c\nNTP=-x a;b `id` {long} 192.0.2.9\n")
    assert place.resolv_conf() == "nameserver 1.1.1.1\n"
    assert place.time_sources() == "server 192.0.2.9 iburst\n"
