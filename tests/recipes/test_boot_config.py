# SPDX-License-Identifier: MIT
"""The program that takes a machine's settings from its boot partition, on made-up folders."""

from __future__ import annotations

import os
import subprocess
from pathlib import Path

import pytest
from conftest import TOP

PROGRAM = TOP / "recipes/recipes-core/ecdaq-config/files/root/usr/lib/ecdaq/boot-config"
# Stands in for `ecdaqd --check --config FILE`: what names a colour is wrong.
DAEMON = """#!/bin/sh
file=$3
if grep -n colour "$file"; then
    echo "ecdaqd: $file:1: no option colour" >&2
    exit 3
fi
"""


class Place:
    """Folders in place of those of a machine."""

    def __init__(self, base: Path) -> None:
        self.source = base / "boot"
        self.target = base / "run"
        self.networkd = base / "networkd"
        self.console = base / "console"
        self.source.mkdir()
        (base / "daemon").write_text(DAEMON)
        (base / "daemon").chmod(0o755)
        (base / "standard.yaml").write_text("cycle:\n  period: 1ms\n")
        (base / "isolated").write_text("3\n")
        self.environment = os.environ | {
            "ECDAQ_BOOT_DIR": str(self.source),
            "ECDAQ_TARGET_DIR": str(self.target),
            "ECDAQ_NETWORKD_DIR": str(self.networkd),
            "ECDAQ_ISOLATED": str(base / "isolated"),
            "ECDAQ_DAEMON": str(base / "daemon"),
            "ECDAQ_STANDARD": str(base / "standard.yaml"),
            "ECDAQ_RECORD_ROOT": str(base),
            "ECDAQ_HOSTS": str(base / "hosts"),
            "ECDAQ_CONSOLE": str(self.console),
        }

    def run(self) -> str:
        """Its output. It never fails: the machine must boot with any contents."""
        self.console.write_text("")
        done = subprocess.run(
            [PROGRAM], env=self.environment, capture_output=True, text=True, check=False
        )
        assert done.returncode == 0, done.stderr
        return done.stderr

    def options(self) -> str:
        return (self.target / "environment").read_text()


@pytest.fixture
def place(tmp_path: Path) -> Place:
    return Place(tmp_path)


@pytest.fixture
def public_key(tmp_path: Path) -> str:
    key = tmp_path / "key"
    subprocess.run(["ssh-keygen", "-q", "-t", "ed25519", "-N", "", "-f", key], check=True)
    return key.with_suffix(".pub").read_text()


def test_without_a_folder_the_built_in_settings_are_used(place: Place) -> None:
    place.source.rmdir()
    output = place.run()
    assert "no ecdaq/ folder on the boot partition" in output
    assert "no user can log in" in output
    assert "period: 1ms" in (place.target / "ecdaq.yaml").read_text()
    assert "--set bus.interface=ecat0" in place.options()
    assert "--set cycle.cpu=3" in place.options()
    assert "--set record.dir=/data/record" in place.options()
    assert "--set record.budget=" in place.options()


def test_an_option_in_the_file_gets_no_default(place: Place) -> None:
    (place.source / "ecdaq.yaml").write_text(
        "bus:\n  interface: lan9\ncycle:\n  cpu: 2\nrecord:\n  dir: /data/x\n  budget: 1GiB\n"
    )
    place.run()
    assert "lan9" in (place.target / "ecdaq.yaml").read_text()
    assert place.options().strip() == "ECDAQ_OPTIONS="


def test_a_broken_file_is_named_and_not_used(place: Place) -> None:
    (place.source / "ecdaq.yaml").write_text("colour: blue\n")
    output = place.run()
    assert "ecdaq.yaml on the boot partition is not used" in output
    assert "built-in settings are used" in output
    assert "colour" not in (place.target / "ecdaq.yaml").read_text()
    assert "is not used" in place.console.read_text()


@pytest.mark.parametrize("text", ["", "x" * 70000])
def test_an_empty_or_huge_file_is_ignored(place: Place, text: str) -> None:
    (place.source / "ecdaq.yaml").write_text(text)
    assert "ignored" in place.run()
    assert "period: 1ms" in (place.target / "ecdaq.yaml").read_text()


def test_keys_with_windows_line_ends_are_taken(place: Place, public_key: str) -> None:
    (place.source / "authorized_keys").write_text(public_key.replace("\n", "\r\n"))
    output = place.run()
    assert "no user can log in" not in output
    assert (place.target / "ssh/operator").read_text() == public_key


def test_a_file_without_a_key_allows_no_login(place: Place) -> None:
    (place.source / "authorized_keys").write_text("please let me in\n")
    output = place.run()
    assert "no usable key" in output
    assert (place.target / "ssh/operator").read_text() == ""


@pytest.mark.parametrize("name", ["-x", "a b;reboot", "x" * 64, "ä"])
def test_what_is_no_host_name_is_refused(place: Place, name: str) -> None:
    (place.source / "hostname").write_text(name + "\n")
    assert "hostname:" in place.run()
    assert (place.target / "hostname").read_text() == "ecdaq\n"


def network_files(place: Place, files: dict[str, str]) -> str:
    """The output of the program with these files in network/."""
    (place.source / "network").mkdir()
    for name, text in files.items():
        (place.source / "network" / name).write_text(text)
    return place.run()


# What takes or renames the port in networkd's or udev's order, if it is looked at first.
TAKERS = {
    "00-lan.network": "[Match]\nName=e*\n[Network]\nDHCP=yes\n",
    "01-all.network": "[Match]\nType=ether\n[Network]\nDHCP=yes\n",
    "01-x.link": "[Match]\nOriginalName=*\n[Link]\nName=lan0\n",
    "10-ecat.network": "[Match]\nName=*\n[Network]\nDHCP=yes\n",
    "10-ecat.link": "[Match]\nDriver=*\n[Link]\nName=lan0\n",
}


@pytest.mark.parametrize("name", TAKERS)
def test_no_network_file_is_looked_at_before_those_of_the_ethercat_port(
    place: Place, name: str
) -> None:
    network_files(place, {name: TAKERS[name]})
    (taken,) = (p.name for p in place.networkd.iterdir())
    kind = taken.rpartition(".")[2]
    recipes = TOP / "recipes/recipes-core"
    own = {p.name for p in recipes.rglob(f"*.{kind}")}
    ports = {name for name in own if name.startswith("10-")}
    assert ports
    assert max(ports) < taken
    assert all(taken < name for name in own - ports)


@pytest.mark.parametrize(
    "text",
    [
        "[Match]\nName=ecat0\n",
        "[Match]\n Name = lan0 ECAT0\n",
        "[NetDev]\nName=ecat0\nKind=dummy\n",
        "[Link]\nAlternativeName=ecat0\n",
        "[Match]\nName=lan0 \\\n ecat0\n",
    ],
)
def test_a_network_file_that_names_the_ethercat_port_is_refused(place: Place, text: str) -> None:
    output = network_files(place, {"10-a.network": "[Match]\nName=lan0\n", "20-b.netdev": text})
    assert [p.name for p in place.networkd.iterdir()] == ["50-boot-10-a.network"]
    assert "20-b.netdev: names the EtherCAT port" in output


def test_a_network_file_with_a_strange_name_is_refused(place: Place) -> None:
    assert "letters, digits" in network_files(place, {"a b.network": "[Match]\nName=lan0\n"})
    assert list(place.networkd.iterdir()) == []


def test_time_servers_are_addresses_and_nothing_else(place: Place) -> None:
    (place.source / "time-servers").write_text("# ours\r\nntp1.example\r\n$(reboot)\n192.0.2.1\n")
    output = place.run()
    sources = (place.target / "chrony.d/boot.sources").read_text()
    assert sources == "server ntp1.example iburst\nserver 192.0.2.1 iburst\n"
    assert "is not an address" in output


@pytest.mark.parametrize(
    ("text", "is_set_by_machine"),
    [
        ("dds:\n  enable: on\n  interface: eth1\n", True),
        ("bus:\n  watchdog: 1s\ndds:\n  interface: eth1\n", True),
        ("# bus:\n#   interface: eth1\ncycle:\n  period: 1ms\n", True),
        ("bus:\n  # the port\n  interface : eth0\n", False),
        ("dds:\n  interface: eth1\nbus:\n  interface: eth0\n", False),
        ("bus: {interface: eth0}\n", False),
        ("bus: {watchdog: 1s, interface: eth0}\n", False),
    ],
)
def test_the_port_is_set_unless_the_file_has_that_of_the_bus(
    place: Place, text: str, is_set_by_machine: bool
) -> None:
    (place.source / "ecdaq.yaml").write_text(text)
    place.run()
    assert ("bus.interface=ecat0" in place.options()) is is_set_by_machine
