# SPDX-License-Identifier: MIT
"""Nonsense on the boot partition: a clear message, the built-in settings, and SSH all the same."""

from __future__ import annotations

from machine import Machine

BOOT_FILES = {
    "ecdaq.yaml": "cycle:\n  period: 1ms\n  colour: blue\n",
    "hostname": "not a name!\n",
    "network/50-port.network": "[Match]\nName=ecat0\n[Network]\nDHCP=yes\n",
    "time-servers": "192.0.2.1\n$(reboot)\n",
}


def test_the_console_names_the_error_and_its_place(machine: Machine) -> None:
    console = machine.console()
    assert "ecdaq.yaml on the boot partition is not used" in console
    assert "ecdaq.yaml:3" in console
    assert "colour" in console
    assert "hostname: 'notaname!' is not a host name" in console
    assert "50-port.network: names the EtherCAT port" in console


def test_the_journal_has_the_same_messages(machine: Machine) -> None:
    journal = machine.run("sudo journalctl --boot --unit=ecdaq-boot-config --output=cat")
    assert "is not used" in journal


def test_the_built_in_settings_are_used(machine: Machine) -> None:
    assert "colour" not in machine.run("cat /run/ecdaq-boot/ecdaq.yaml")
    assert machine.run("systemctl is-active ecdaq-boot-config").strip() == "active"
    assert "$(" not in machine.run("cat /run/ecdaq-boot/chrony.d/boot.sources")
    assert "server 192.0.2.1 iburst" in machine.run("cat /run/ecdaq-boot/chrony.d/boot.sources")
