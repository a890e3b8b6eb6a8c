# SPDX-License-Identifier: MIT
"""A machine with a key and a name on its boot partition boots as configured."""

from __future__ import annotations

import base64
import gzip
import re
from pathlib import Path

import pytest
from machine import TOP, Machine

BOOT_FILES = {"hostname": "bench-7\r\n"}
HERE = Path(__file__).parent
# What systemd-analyze prints today; a unit may get better, never worse (0 is best, 10 worst).
EXPOSURE_LIMITS = {
    "ecdaqd.service": 2.0,
    "ecdaq-record.service": 1.5,
    "ecdaq-dds.service": 2.0,
    "ecdaq-sync0.service": 2.0,
    "ecdaq-web.service": 1.5,
    "ecdaq-web-command.service": 1.5,
    "ecdaq-stream.service": 1.5,
    "ecdaq-uplink.service": 1.5,
    "ecdaq-boot-config.service": 2.5,
    "ecdaq-boot-bad.service": 3.5,
    "ecdaq-boot-good.service": 3.5,
    "ecdaq-clock.service": 2.0,
    "ecdaq-firewall.service": 2.5,
    "ecdaq-health.service": 2.5,
    "ecdaq-names.service": 1.5,
    "ecdaq-nic.service": 3.5,
    "ecdaq-ssh-key.service": 2.0,
    "ecdaq-segment.service": 2.0,
    "ecdaq-update-media.service": 3.0,
}


def test_the_kernel_is_a_real_time_kernel(machine: Machine) -> None:
    assert machine.run("cat /sys/kernel/realtime").strip() == "1"


def test_the_command_line_isolates_the_last_core(machine: Machine) -> None:
    words = machine.run("cat /proc/cmdline").split()
    for word in ("isolcpus=managed_irq,domain,1", "nohz_full=1", "rcu_nocbs=1", "irqaffinity=0"):
        assert word in words
    assert machine.run("cat /sys/devices/system/cpu/isolated").strip() == "1"
    assert machine.run("cat /sys/devices/system/cpu/nohz_full").strip() == "1"


def test_every_kernel_symbol_asked_for_is_set(machine: Machine, tmp_path: Path) -> None:
    import sys

    sys.path.insert(0, str(TOP / "layers" / "meta-local" / "lib"))
    from kconfig import differences

    text = gzip.decompress(base64.b64decode(machine.run("base64 /proc/config.gz")))
    (tmp_path / "config").write_bytes(text)
    assert differences(tmp_path / "config", sorted((TOP / "kernel-config").glob("*.cfg"))) == []


def test_no_unit_has_failed(machine: Machine) -> None:
    machine.wait_until("boot is over", "systemctl is-system-running | grep -Eqv 'initializ|start'")
    assert machine.run("systemctl --failed --no-legend --plain").strip() == ""


def test_the_log_has_no_error_that_is_not_known(machine: Machine) -> None:
    lines = (HERE / "log_errors_allowed.txt").read_text().splitlines()
    allowed = [re.compile(line) for line in lines if line and not line.startswith("#")]
    journal = machine.run("sudo journalctl --boot --priority=err --output=cat --no-pager")
    unknown = [x for x in journal.splitlines() if x and not any(a.search(x) for a in allowed)]
    assert unknown == []


def test_the_boot_has_no_ordering_cycle(machine: Machine) -> None:
    assert machine.try_run("sudo journalctl --boot _PID=1 --grep='ordering cycle'").returncode == 1


def test_the_name_is_that_of_the_boot_partition(machine: Machine) -> None:
    assert machine.run("hostname").strip() == "bench-7"


def test_the_root_is_read_only_and_the_data_partition_has_grown(machine: Machine) -> None:
    assert machine.try_run("sudo touch /usr/x").returncode != 0
    assert " ro," in machine.run("grep ' / ' /proc/mounts")
    size = int(machine.run("df --output=size -B1M /data | tail -n 1"))
    assert size > 500, "the image's data partition has 256 MiB, this disk has room for 800"
    machine.run("sudo touch /data/x /etc/x /var/x && sudo rm /data/x /etc/x /var/x")


def test_only_ssh_listens(machine: Machine) -> None:
    tcp = machine.run("ss --no-header --listening --numeric --tcp")
    assert {line.split()[3].rpartition(":")[2] for line in tcp.splitlines()} == {"22"}
    udp = machine.run("ss --no-header --listening --numeric --udp")
    # 68: the answers to our own DHCP requests.
    assert {line.split()[3].rpartition(":")[2] for line in udp.splitlines()} <= {"68", "546"}


def test_no_user_has_a_password(machine: Machine) -> None:
    shadow = machine.run("sudo cat /etc/shadow").splitlines()
    assert shadow
    assert [line for line in shadow if line.split(":")[1][:1] not in ("!", "*")] == []


def test_the_name_server_of_dhcp_is_that_of_libc(machine: Machine) -> None:
    # 10.0.2.3 is the name server that QEMU's network announces.
    machine.wait_until("a name server", "grep -qx 'nameserver 10.0.2.3' /etc/resolv.conf")
    assert machine.run("systemctl is-failed ecdaq-names.service || true").strip() != "failed"


def test_the_time_is_kept_for_the_next_start(machine: Machine) -> None:
    assert machine.run("systemctl is-active ecdaq-clock.timer").strip() == "active"
    # The timer would take a minute of the guest's time.
    machine.run("sudo systemctl start ecdaq-clock.service")
    machine.run("test -e /var/lib/ecdaq-clock/stamp")


def test_passwords_and_root_are_refused_over_ssh(machine: Machine) -> None:
    settings = machine.run("sudo sshd -T").splitlines()
    for line in ("passwordauthentication no", "permitrootlogin no", "allowusers operator"):
        assert line in settings


def test_only_sudo_runs_as_another_user_than_who_starts_it(machine: Machine) -> None:
    """Of the 14 set-user-ID and set-group-ID programs that Debian's packages bring."""
    found = machine.run("sudo find / -xdev -type f -perm /6000").split()
    assert found == ["/usr/bin/sudo"]


def test_only_ssh_listens_to_others(machine: Machine) -> None:
    lines = machine.run("sudo ss -H -tuln").splitlines()
    found = {(words[0], *words[4].rsplit(":", 1)) for words in map(str.split, lines)}
    local = ("127.", "[::1]")
    assert {
        (kind, int(port)) for kind, address, port in found if not address.startswith(local)
    } <= {
        ("tcp", 22),
        ("udp", 68),  # DHCP client
    }
    assert "policy drop" in machine.run("sudo nft list chain inet ecdaq input")


def test_the_journal_is_kept_and_bounded(machine: Machine) -> None:
    assert machine.run("sudo find /var/log/journal -name system.journal").strip()
    used = machine.run("sudo journalctl --disk-usage")
    figure, unit = re.findall(r"([\d.]+)([KMG])", used)[0]
    assert unit in "KM"
    assert unit == "K" or float(figure) <= 64


def test_udev_takes_our_rules(machine: Machine) -> None:
    machine.run("sudo udevadm verify --no-style /usr/lib/udev/rules.d/*ecdaq*.rules")


def test_without_their_files_nothing_is_sent_and_no_second_clock_runs(machine: Machine) -> None:
    """Units that come with Debian's packages, and ours that wait for a file."""
    units = machine.run("systemctl list-units --type=service --plain --no-legend --state=active")
    for unit in ("journal-upload", "journal-remote", "journal-gatewayd", "ptp4l", "phc2sys"):
        assert unit not in units
    assert "timemaster" not in units and "ecdaq-ptp" not in units
    assert machine.run("systemctl is-active chrony ecdaq-update-media.path").split() == [
        *("active", "active")
    ]


def test_the_watchdog_is_fed_by_systemd(machine: Machine) -> None:
    usec = machine.run("systemctl show --property=RuntimeWatchdogUSec --value").strip()
    assert usec == "15s"
    usec = machine.run("systemctl show --property=RebootWatchdogUSec --value").strip()
    assert usec == "15s"


def test_a_service_can_neither_command_the_master_nor_take_names_of_its_files(
    machine: Machine,
) -> None:
    """ecdaq-dds reads the network: whoever takes it over has what it may."""
    machine.run("ecdaq status > /dev/null")
    for command, refused in (
        ("ecdaq stop", "no permission to use the admin socket"),
        ("touch /run/ecdaq/samples.new", "Permission denied"),
        ("touch /run/ecdaq/record/status", "Permission denied"),
    ):
        done = machine.run(f"sudo -u ecdaq-dds {command} 2>&1; echo $?")
        assert refused in done and not done.endswith("\n0\n"), done
    machine.run("sudo -u ecdaq-dds ecdaq status > /dev/null")
    assert machine.run("stat -c %G /run/ecdaq/commands-remote").strip() == "ecdaq-remote"


@pytest.mark.parametrize("unit", sorted(EXPOSURE_LIMITS))
def test_the_exposure_of_a_service_is_bounded(machine: Machine, unit: str) -> None:
    message = machine.run(f"systemd-analyze security --no-pager {unit} | tail -n 1")
    figure = float(re.findall(r": ([\d.]+) ", message)[0])
    print(f"{unit}: {figure}")
    assert figure <= EXPOSURE_LIMITS[unit]
