# SPDX-License-Identifier: MIT
"""A machine whose clock chip has forgotten the time continues after its last run."""

from __future__ import annotations

from machine import Machine

START = {"options": ("-rtc", "base=2001-02-03")}
LAST_RUN = "2035-01-02"


def test_the_clock_of_a_machine_without_a_clock_chip_continues(machine: Machine) -> None:
    assert int(machine.run("date -u +%Y")) < int(LAST_RUN[:4])
    # The service makes the folder of its file.
    machine.run("sudo systemctl start ecdaq-clock.service")
    machine.run("sudo systemctl stop ecdaq-clock.timer")
    machine.run(f"sudo touch -d {LAST_RUN} /var/lib/ecdaq-clock/stamp && sudo sync")
    machine.cut_power()
    machine.start(**START)
    machine.wait_for_login()
    machine.wait_until("SSH answers", "true", 600)
    assert machine.run("date -u +%Y-%m-%d").strip() == LAST_RUN
    first = machine.run("sudo journalctl --boot --output=short-iso --no-pager | head -n 1")
    assert first.startswith(LAST_RUN), "the journal of this boot begins at another time"
    assert "clock continues after the last run" in machine.console_of_this_boot()
