# SPDX-License-Identifier: MIT
"""What a login shell of the image reads."""

from __future__ import annotations

import os
import subprocess

import pytest
from test_packages import STAGE, TOP

PROFILE = TOP / "recipes/recipes-core/ecdaq-config/files/root/etc/profile.d/ecdaq.sh"


def login(*shell: str) -> subprocess.CompletedProcess[str]:
    """Its output after the file was read."""
    script = f". {PROFILE} && echo end && complete -p ecdaq"
    path = f"{STAGE / 'bin'}:{os.environ['PATH']}"
    return subprocess.run(
        [*shell, script],
        env={"PATH": path},
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        check=False,
    )


def test_ecdaq_is_completed_where_one_logs_in() -> None:
    done = login("bash", "--norc", "-i", "-c")
    assert done.stdout.splitlines() == ["end", "complete -o default -F _ecdaq ecdaq"], done.stderr


@pytest.mark.parametrize("shell", [["bash", "-c"], ["sh", "-c"], ["dash", "-i", "-c"]])
def test_a_script_and_another_shell_are_left_alone(shell: list[str]) -> None:
    assert login(*shell).stdout == "end\n"
