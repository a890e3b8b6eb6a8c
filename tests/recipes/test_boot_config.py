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
            "ECDAQ_UPLOAD_DIR": str(base / "upload"),
            "ECDAQ_UPLINK_USER": str(os.getuid()),
            "ECDAQ_WPA_SUPPLICANT": str(base / "wpa_supplicant"),
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
        "uplink:\n  dir: /data/y\n"
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


# PTP


@pytest.mark.parametrize(
    ("text", "transport", "domain"),
    [
        ("enp1s0\n", "UDPv4", 0),
        ("# our clock\r\nenp1s0 udp 3\r\n", "UDPv4", 3),
        ("enp1s0 24", "UDPv4", 24),
        ("enp1s0 l2 # frames\n", "L2", 0),
    ],
)
def test_a_port_follows_a_ptp_server(place: Place, text: str, transport: str, domain: int) -> None:
    (place.source / "ptp").write_text(text)
    assert "ptp:" not in place.run()
    found = (place.target / "ptp/enp1s0.conf").read_text().splitlines()
    assert found[0] == "[global]" and found[-1] == "[enp1s0]"
    # It never offers its own time.
    assert {"clientOnly 1", f"domainNumber {domain}", f"network_transport {transport}"} < set(found)
    assert (place.target / "ptp/enp1s0.domain").read_text() == f"{domain}\n"
    assert "refclock SHM 0" in (place.target / "chrony.conf.d/ptp.conf").read_text()


@pytest.mark.parametrize(
    "text",
    [
        *("ecat0", "ecsim0 l2", "enp1s0 tcp", "enp1s0 l2 256", "enp1s0 l2 -1", "enp1s0 udp 0 x"),
        *("enp1s0\nenp2s0", "a;b", "[global]", "enp1s0 l2 0xf", "# nothing", "x" * 16),
    ],
)
def test_what_is_no_ptp_port_is_ignored(place: Place, text: str) -> None:
    (place.source / "ptp").write_text(text + "\n")
    assert "ptp: not one line" in place.run()
    assert list((place.target / "ptp").iterdir()) == []
    assert (place.target / "chrony.conf.d/ptp.conf").read_text() == ""


def test_without_a_file_chrony_has_no_ptp(place: Place) -> None:
    place.run()
    assert list((place.target / "ptp").iterdir()) == []
    assert (place.target / "chrony.conf.d/ptp.conf").read_text() == ""


# Copies of the journal


def upload(place: Place) -> dict[str, str]:
    path = place.target.parent / "upload/50-boot.conf"
    if not path.exists():
        return {}
    first, *lines = path.read_text().splitlines()
    assert first == "[Upload]"
    return dict(line.split("=", 1) for line in lines)


def test_the_journal_stays_here_unless_a_file_says_where_it_goes(place: Place) -> None:
    (place.source / "journal-upload").write_text("# ours\r\nhttps://logs.example:19532\r\n")
    place.run()
    assert upload(place) == {
        "URL": "https://logs.example:19532",
        "ServerKeyFile": "-",
        "ServerCertificateFile": "-",
        "TrustedCertificateFile": "/etc/ssl/certs/ca-certificates.crt",
    }
    (place.source / "journal-upload").unlink()
    place.run()
    assert upload(place) == {}


def test_keys_for_the_journal_are_of_the_boot_partition(place: Place) -> None:
    (place.source / "journal-upload").write_text("https://[2001:db8::1]:19532/\n")
    for name in ("journal-upload.key", "journal-upload.pem", "journal-upload-ca.pem"):
        (place.source / name).write_text("-----BEGIN X-----\r\n")
    place.run()
    found = upload(place)
    assert found.pop("URL") == "https://[2001:db8::1]:19532/"
    assert len(found) == 3
    assert [Path(path).read_text() for path in found.values()] == ["-----BEGIN X-----\n"] * 3
    (place.source / "journal-upload-ca.pem").write_text("a letter\n")
    assert "journal-upload-ca.pem: no PEM file, ignored" in place.run()
    # The server is still checked: by the authorities of the image.
    assert upload(place)["TrustedCertificateFile"] == "/etc/ssl/certs/ca-certificates.crt"


@pytest.mark.parametrize(
    "text", ["logs.example", "ftp://a", "https://", "https://a\nhttps://b", "http://a b", "# none"]
)
def test_what_is_no_url_uploads_nothing(place: Place, text: str) -> None:
    (place.source / "journal-upload").write_text(text + "\n")
    assert "journal-upload: '" in place.run()
    assert upload(place) == {}


# Wi-Fi

WIFI = (
    'ctrl_interface=/run/x\r\ncountry=DE\r\nnetwork={\r\n\tssid="hall"\r\n\tpsk="12345678"\r\n}\r\n'
)


def test_wifi_needs_an_image_that_has_it(place: Place) -> None:
    (place.source / "wifi").write_bytes(WIFI.encode())
    assert "wifi: this image was built without Wi-Fi, ignored" in place.run()
    assert not (place.target / "wifi.conf").exists()
    (place.target.parent / "wpa_supplicant").touch(0o755)
    assert "wifi:" not in place.run()
    path = place.target / "wifi.conf"
    assert path.read_text() == 'country=DE\nnetwork={\n\tssid="hall"\n\tpsk="12345678"\n}\n'
    assert path.stat().st_mode & 0o777 == 0o600


def test_a_wifi_file_without_a_network_or_with_a_program_is_not_used(place: Place) -> None:
    (place.target.parent / "wpa_supplicant").touch(0o755)
    (place.source / "wifi").write_text("ssid hall\n")
    assert "wifi: no network={...}" in place.run()
    assert not (place.target / "wifi.conf").exists()
    (place.source / "wifi").write_text("pkcs11_module_path=/x.so\nnetwork={\n}\n")
    place.run()
    assert (place.target / "wifi.conf").read_text() == "network={\n}\n"


def test_the_key_of_the_object_store_is_for_its_service_alone(place: Place) -> None:
    place.run()
    assert "uplink.dir=/data/uplink" in place.options()
    assert "uplink.credentials" not in place.options()
    (place.source / "uplink.credentials").write_text("aws_access_key_id = a\r\n")
    assert "uplink" not in place.run()
    copy = place.target / "uplink.credentials"
    assert copy.read_text() == "aws_access_key_id = a\n"
    assert copy.stat().st_mode & 0o777 == 0o600
    assert f"--set uplink.credentials={copy}" in place.options()
    (place.source / "ecdaq.yaml").write_text("uplink:\n  dir: /mnt/a\n  credentials: /mnt/b\n")
    place.run()
    assert "uplink." not in place.options()
