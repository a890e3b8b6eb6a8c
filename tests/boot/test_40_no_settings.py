# SPDX-License-Identifier: MIT
"""An untouched card: the machine comes up, says that nobody can log in, and lets nobody in."""

from __future__ import annotations

from machine import Machine

WITH_KEY = False


def test_the_console_says_that_nobody_can_log_in(machine: Machine) -> None:
    assert "nobody can log in: no key in authorized_keys" in machine.console()


def test_nobody_is_let_in(machine: Machine) -> None:
    result = machine.try_run("true")
    assert result.returncode == 255


def test_the_bus_runs_all_the_same(machine: Machine) -> None:
    machine.wait_for_console(r"ecat0: entered promiscuous mode")
    machine.wait_for_console(r"Started .*ecdaqd.service")
    assert "ecdaq-preinit: memory instead" not in machine.console()
