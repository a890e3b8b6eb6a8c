# SPDX-License-Identifier: MIT
"""An unmodified card: the machine boots, reports that no user can log in, and accepts no login."""

from __future__ import annotations

from machine import Machine

WITH_KEY = False


def test_the_console_reports_that_no_user_can_log_in(machine: Machine) -> None:
    assert "no user can log in: no key in authorized_keys" in machine.console()


def test_no_login_is_accepted(machine: Machine) -> None:
    result = machine.try_run("true")
    assert result.returncode == 255


def test_the_bus_runs_with_the_built_in_settings(machine: Machine) -> None:
    machine.wait_for_console(r"ecat0: entered promiscuous mode")
    machine.wait_for_console(r"Started .*ecdaqd.service")
    assert "ecdaq-preinit: memory instead" not in machine.console()
