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


def test_the_master_is_not_restarted_after_a_requested_stop_or_a_crash_of_control() -> None:
    assert values("ecdaqd.service", "Restart") == ["always"]
    codes = [exit_code("OVERRUN"), exit_code("CONTROL")]
    assert values("ecdaqd.service", "RestartPreventExitStatus") == codes


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


@pytest.mark.skipif(not shutil.which("systemd-analyze"), reason="no systemd-analyze here")
@pytest.mark.parametrize("path", SERVICES, ids=lambda p: p.stem)
def test_every_service_is_sandboxed(path: Path) -> None:
    command = ["systemd-analyze", "security", "--offline=true", "--no-pager", str(path)]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    figure = float(re.findall(r"exposure level for \S+: ([\d.]+) ", done.stdout)[0])
    print(f"{path.stem}: {figure}")
    assert figure < EXPOSURE_LIMIT


def test_a_service_writes_in_its_own_folder_of_the_run_directory_only() -> None:
    folders = (ROOT / "usr/lib/tmpfiles.d/ecdaq.conf").read_text()
    for unit in ("ecdaq-record", "ecdaq-dds", "ecdaq-sync0"):
        own = "/run/ecdaq/" + unit.removeprefix("ecdaq-")
        assert f"d {own} 2750 {unit} ecdaq-read -\n" in folders
        writes = " ".join(values(f"{unit}.service", "ReadWritePaths")).split()
        assert [p for p in writes if p.startswith("/run/")] == [own]
    assert "d /run/ecdaq 2750 ecdaqd ecdaq-read -\n" in folders


def test_only_an_operator_commands_the_master_and_only_dds_sets_remote_outputs() -> None:
    text = (ROOT / "usr/lib/sysusers.d/ecdaq.conf").read_text()
    members = [line.split()[1:] for line in text.splitlines() if line.startswith("m ")]
    # ecdaqd gives its sockets away, for which it has to be a member.
    assert {user for user, group in members if group == "ecdaq-admin"} == {"ecdaqd", "operator"}
    assert {user for user, group in members if group == "ecdaq-remote"} == {"ecdaqd", "ecdaq-dds"}
    for unit in UNITS.glob("*.service"):
        assert values(unit.name, "Group") in ([], ["ecdaq-read"])
        assert values(unit.name, "SupplementaryGroups") == []
