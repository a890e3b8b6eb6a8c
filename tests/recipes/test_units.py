# SPDX-License-Identifier: MIT
"""The services start again what may end by accident, and leave alone what ended for a reason."""

from __future__ import annotations

import re
import shutil
import subprocess
from pathlib import Path

import pytest
from conftest import TOP
from metadata import Metadata

ROOT = TOP / "recipes/recipes-core/ecdaq-config/files/root"
UNITS = ROOT / "usr/lib/systemd/system"
SERVICES = sorted((TOP / "recipes").rglob("*.service"))
# systemd-analyze's figure for what a service may do: 0 is best, 10 worst.
EXPOSURE_LIMIT = 5.0


def values(unit: str, key: str) -> list[str]:
    """All words that a unit file gives a key."""
    lines = re.findall(rf"^{key}=(.*)$", (UNITS / unit).read_text(), re.MULTILINE)
    return [word for line in lines for word in line.split()]


def exit_code(name: str) -> str:
    text = (TOP / "app/core/program/exit_code.h").read_text()
    return re.findall(rf"EXIT_CODE_{name} = (\d+),", text)[0]


def test_the_master_is_not_restarted_where_that_would_end_in_the_same_way() -> None:
    """A requested stop, a crash of the control program, a port that is refused."""
    assert values("ecdaqd.service", "Restart") == ["always"]
    codes = [exit_code("BUSY"), exit_code("OVERRUN"), exit_code("CONTROL")]
    assert values("ecdaqd.service", "RestartPreventExitStatus") == codes


def test_a_reload_tells_its_error_to_whoever_asked_for_it() -> None:
    words = values("ecdaqd.service", "ExecReload")
    assert words == ["/usr/bin/ecdaq", "--run-dir", "/run/ecdaq", "config", "reload"]
    start = values("ecdaqd.service", "ExecStart")
    assert start[start.index("--run-dir") + 1] == words[2]


def test_the_units_of_the_debian_packages_have_the_same_rules(tmp_path: Path) -> None:
    subprocess.run(["sh", TOP / "app/packaging/debian-units.sh", ROOT, tmp_path], check=True)
    text = (tmp_path / "units/ecdaqd.service").read_text()
    for key in ("RestartPreventExitStatus", "ExecReload", "Restart"):
        assert f"{key}={' '.join(values('ecdaqd.service', key))}\n" in text


@pytest.mark.parametrize("key", ["RuntimeWatchdogSec", "RebootWatchdogSec"])
def test_a_watchdog_is_set_to_no_more_than_the_chip_counts(metadata: Metadata, key: str) -> None:
    text = (ROOT / "usr/lib/systemd/system.conf.d/60-ecdaq.conf").read_text()
    (seconds,) = re.findall(rf"^{key}=(\d+)s$", text, re.MULTILINE)
    limit = int(metadata.recipes["ecdaq-image"].value("ECDAQ_WATCHDOG_LIMIT_S"))
    assert 0 < int(seconds) <= limit


def test_the_kernel_feeds_an_armed_watchdog_while_the_disk_is_checked(metadata: Metadata) -> None:
    """e2fsck and resize2fs of a large card take longer than the chip counts, before systemd."""
    words = metadata.recipes["ecdaq-image"].value("KERNEL_CMDLINE").split()
    assert "watchdog.handle_boot_enabled=1" in words
    (timeout,) = (int(w.partition("=")[2]) for w in words if w.startswith("watchdog.open_timeout="))
    assert 300 <= timeout <= 3600


def test_libc_reads_what_is_written_when_the_network_changes() -> None:
    assert values("ecdaq-names.path", "PathChanged") == ["/run/systemd/netif/state"]
    assert "ecdaq-names" in values("ecdaq-names.service", "RuntimeDirectory")
    links = (ROOT / "usr/lib/tmpfiles.d/ecdaq.conf").read_text()
    assert "L /etc/resolv.conf - - - - /run/ecdaq-names/resolv.conf\n" in links


def exposure(path: Path) -> float:
    command = ["systemd-analyze", "security", "--offline=true", "--no-pager", str(path)]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    return float(re.findall(r"exposure level for \S+: ([\d.]+) ", done.stdout)[0])


@pytest.mark.skipif(not shutil.which("systemd-analyze"), reason="no systemd-analyze here")
@pytest.mark.parametrize("path", SERVICES, ids=lambda p: p.stem)
def test_every_service_is_sandboxed(path: Path) -> None:
    figure = exposure(path)
    print(f"{path.stem}: {figure}")
    assert figure < EXPOSURE_LIMIT


def test_a_service_writes_in_its_own_folder_of_the_run_directory_only() -> None:
    folders = (ROOT / "usr/lib/tmpfiles.d/ecdaq.conf").read_text()
    services = ("ecdaq-record", "ecdaq-dds", "ecdaq-sync0", "ecdaq-stream", "ecdaq-uplink")
    for unit in (*services, "ecdaq-web-command"):
        own = "/run/ecdaq/" + unit.removeprefix("ecdaq-")
        assert f"d {own} 2750 {unit} ecdaq-read -\n" in folders
        writes = " ".join(values(f"{unit}.service", "ReadWritePaths")).split()
        assert [p for p in writes if p.startswith("/run/")] == [own]
    assert "d /run/ecdaq 2750 ecdaqd ecdaq-read -\n" in folders


def test_the_page_writes_nothing_and_its_user_is_its_own() -> None:
    assert values("ecdaq-web.service", "ReadWritePaths") == []
    assert values("ecdaq-web.service", "ProtectSystem") == ["strict"]
    assert values("ecdaq-web.service", "User") == ["ecdaq-web"]
    text = (ROOT / "usr/lib/sysusers.d/ecdaq.conf").read_text()
    assert re.findall(r"^u ecdaq-web (\d+):900 ", text, re.MULTILINE) == ["908"]
    assert re.search(r"^m ecdaq-web ", text, re.MULTILINE) is None
    # Whoever takes it over has the network, and little else.
    if shutil.which("systemd-analyze"):
        assert exposure(UNITS / "ecdaq-web.service") < 1.5


def test_what_may_command_for_the_page_has_no_network_and_a_user_of_its_own() -> None:
    unit = "ecdaq-web-command.service"
    assert values(unit, "PrivateNetwork") == ["yes"]
    assert values(unit, "RestrictAddressFamilies") == ["AF_UNIX"]
    assert values(unit, "ReadWritePaths") == ["/run/ecdaq/web-command"]
    assert values(unit, "ProtectSystem") == ["strict"]
    assert values(unit, "User") == ["ecdaq-web-command"]
    text = (ROOT / "usr/lib/sysusers.d/ecdaq.conf").read_text()
    assert re.findall(r"^u ecdaq-web-command (\d+):900 ", text, re.MULTILINE) == ["911"]
    assert "m ecdaq-web-command ecdaq-admin\n" in text
    if shutil.which("systemd-analyze"):
        assert exposure(UNITS / unit) < 1.5


def test_the_page_is_off_until_it_is_configured() -> None:
    """The unit is started on every machine, and the program ends well."""
    options = (TOP / "app/doc/reference/ecdaq.sample.yaml").read_text()
    found = re.findall(r"^  (\w+): (\S+)$", options.split("\nweb:\n")[1], re.MULTILINE)
    assert found[:2] == [("enable", "off"), ("listen", "loopback")]
    assert values("ecdaq-web.service", "Restart") == ["on-failure"]


def test_the_stream_writes_its_status_only_and_is_off_until_it_is_configured() -> None:
    unit = "ecdaq-stream.service"
    assert values(unit, "ReadWritePaths") == ["/run/ecdaq/stream"]
    assert values(unit, "ProtectSystem") == ["strict"]
    assert values(unit, "User") == ["ecdaq-stream"]
    assert values(unit, "CapabilityBoundingSet") == []
    assert values(unit, "Restart") == ["on-failure"]
    text = (ROOT / "usr/lib/sysusers.d/ecdaq.conf").read_text()
    assert re.findall(r"^u ecdaq-stream (\d+):900 ", text, re.MULTILINE) == ["910"]
    assert "m ecdaq-stream" not in text
    options = (TOP / "app/doc/reference/ecdaq.sample.yaml").read_text()
    found = re.findall(r"^  (\w+): (\S+)$", options.split("\nstream:\n")[1], re.MULTILINE)
    assert found[0] == ("enable", "off")
    if shutil.which("systemd-analyze"):
        assert exposure(UNITS / unit) < 1.5


def test_no_two_users_have_one_number() -> None:
    """Files of the one on the data partition would be the other's."""
    text = (ROOT / "usr/lib/sysusers.d/ecdaq.conf").read_text()
    numbers = re.findall(r"^u \S+ (\d+)", text, re.MULTILINE)
    assert len(numbers) > 5 and len(numbers) == len(set(numbers)), numbers


def test_the_uplink_writes_its_marks_only_and_is_off_until_it_is_configured() -> None:
    unit = "ecdaq-uplink.service"
    assert values(unit, "ReadWritePaths") == ["/run/ecdaq/uplink", "/data/uplink"]
    assert values(unit, "ProtectSystem") == ["strict"]
    assert values(unit, "User") == ["ecdaq-uplink"]
    assert values(unit, "CapabilityBoundingSet") == []
    assert values(unit, "Restart") == ["on-failure"]
    text = (ROOT / "usr/lib/sysusers.d/ecdaq.conf").read_text()
    assert re.findall(r"^u ecdaq-uplink (\d+):900 ", text, re.MULTILINE) == ["912"]
    assert "m ecdaq-uplink" not in text
    # The recorder, in the same group, reads the marks.
    folders = (ROOT / "usr/lib/tmpfiles.d/ecdaq.conf").read_text()
    assert "d /data/uplink 2750 ecdaq-uplink ecdaq-read -\n" in folders
    assert values(unit, "UMask") == ["0027"]
    options = (TOP / "app/doc/reference/ecdaq.sample.yaml").read_text()
    found = re.findall(r"^  (\w+): (\S+)$", options.split("\nuplink:\n")[1], re.MULTILINE)
    assert found[0] == ("enable", "off")
    if shutil.which("systemd-analyze"):
        assert exposure(UNITS / unit) < 1.5


def test_operators_and_their_page_command_the_master_and_only_dds_sets_remote_outputs() -> None:
    text = (ROOT / "usr/lib/sysusers.d/ecdaq.conf").read_text()
    members = [line.split()[1:] for line in text.splitlines() if line.startswith("m ")]
    # ecdaqd gives its sockets away, for which it has to be a member.
    may_command = {user for user, group in members if group == "ecdaq-admin"}
    assert may_command == {"ecdaqd", "operator", "ecdaq-web-command"}
    assert {user for user, group in members if group == "ecdaq-remote"} == {"ecdaqd", "ecdaq-dds"}
    for unit in UNITS.glob("*.service"):
        assert values(unit.name, "Group") in ([], ["ecdaq-read"])
        assert values(unit.name, "SupplementaryGroups") == []


def test_units_that_come_with_debians_packages_are_off_or_wait_for_a_file() -> None:
    """preset-all would turn on a second time service, and sockets that others reach."""
    preset = (ROOT / "usr/lib/systemd/system-preset/60-ecdaq.preset").read_text().splitlines()
    for unit in (
        *("timemaster.service", "ptp4l@.service", "phc2sys@.service", "wpa_supplicant.service"),
        *("systemd-journal-remote.socket", "systemd-journal-gatewayd.socket"),
    ):
        assert f"disable {unit}" in preset, unit
    waits = (UNITS / "systemd-journal-upload.service.d/60-ecdaq.conf").read_text()
    assert "ConditionPathExists=/run/systemd/journal-upload.conf.d/50-boot.conf\n" in waits
    for unit in ("ecdaq-ptp@.service", "ecdaq-wifi@.service"):
        assert values(unit, "ConditionPathExists")[0].startswith("/run/ecdaq-boot/")


def test_a_port_without_a_ptp_clock_is_said_and_not_used(tmp_path: Path) -> None:
    (tmp_path / "lan0/device").mkdir(parents=True)
    (tmp_path / "console").touch()
    environment = {"ECDAQ_NET_CLASS": str(tmp_path), "ECDAQ_CONSOLE": str(tmp_path / "console")}
    command = [ROOT / "usr/lib/ecdaq/ptp-port", "lan0"]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 1
    assert "lan0 has no PTP clock" in done.stderr
    assert (tmp_path / "console").read_text() == done.stderr
    (tmp_path / "lan0/device/ptp/ptp0").mkdir(parents=True)
    subprocess.run(command, env=environment, check=True)
