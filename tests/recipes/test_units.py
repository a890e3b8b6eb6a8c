# SPDX-License-Identifier: MIT
"""The services start again what may end by accident, and leave alone what ended for a reason."""

from __future__ import annotations

import re

from conftest import TOP

UNITS = TOP / "recipes/recipes-core/ecdaq-config/files/root/usr/lib/systemd/system"


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
