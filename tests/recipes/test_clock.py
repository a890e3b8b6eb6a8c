# SPDX-License-Identifier: MIT
"""The clock of a board without a clock chip continues after the last run."""

from __future__ import annotations

import os
import re
import subprocess
from pathlib import Path

import pytest
from conftest import TOP

ROOT = TOP / "recipes/recipes-core/ecdaq-config/files/root"
PROGRAM = ROOT / "usr/lib/ecdaq/clock"
NOW = 1_000_000_000
# Stands in for date: what it is asked to set, it writes to a file.
DATE = """#!/bin/sh
case $1 in
+%s) echo {now} ;;
*) echo "$*" > {asked} ;;
esac
"""


def clock(folder: Path, verb: str, stamp: Path) -> str:
    """What `date` was asked to set; nothing if it was not."""
    asked = folder / "asked"
    asked.write_text("")
    (folder / "date").write_text(DATE.format(now=NOW, asked=asked))
    (folder / "date").chmod(0o755)
    environment = os.environ | {
        "PATH": f"{folder}:{os.environ['PATH']}",
        "ECDAQ_CLOCK_STAMP": str(stamp),
    }
    subprocess.run([PROGRAM, verb], env=environment, check=True)
    return asked.read_text().strip()


@pytest.fixture
def stamp(tmp_path: Path) -> Path:
    path = tmp_path / "stamp"
    path.touch()
    return path


def test_a_clock_behind_the_last_run_is_set_after_its_end(tmp_path: Path, stamp: Path) -> None:
    os.utime(stamp, (NOW + 5000, NOW + 5000))
    flags, _, seconds = clock(tmp_path, "restore", stamp).partition("@")
    assert flags == "-u -s "
    timer = (ROOT / "usr/lib/systemd/system/ecdaq-clock.timer").read_text()
    minutes, accuracy = re.findall(r"OnUnitActiveSec=(\d+)min\nAccuracySec=(\d+)s", timer)[0]
    assert int(seconds) >= NOW + 5000 + int(minutes) * 60 + int(accuracy)


def test_a_clock_chip_that_is_later_is_believed(tmp_path: Path, stamp: Path) -> None:
    os.utime(stamp, (NOW - 1, NOW - 1))
    assert clock(tmp_path, "restore", stamp) == ""


def test_the_first_start_sets_nothing(tmp_path: Path) -> None:
    assert clock(tmp_path, "restore", tmp_path / "none") == ""


def test_saving_keeps_the_time_of_now(tmp_path: Path, stamp: Path) -> None:
    os.utime(stamp, (0, 0))
    clock(tmp_path, "save", stamp)
    assert stamp.stat().st_mtime > NOW


def test_the_clock_is_restored_before_systemd_starts() -> None:
    lines = (ROOT / "usr/lib/ecdaq/preinit").read_text().splitlines()
    restore = next(i for i, line in enumerate(lines) if "/usr/lib/ecdaq/clock restore" in line)
    assert lines.index("overlay var") < restore < lines.index('exec /usr/lib/systemd/systemd "$@"')
