# SPDX-License-Identifier: MIT
"""Long work on recordings shows how far it is, and at the end what was done."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from ecdaq import OK
from recording import Bench
from terminal import Terminal

CYCLES = 3000


@pytest.fixture
def recorded(bench: Bench) -> Bench:
    producer = bench.produce("--cycles", str(CYCLES))
    producer.communicate(timeout=60)
    bench.record_all()
    return bench


def test_progress_is_on_standard_error_when_requested(recorded: Bench, tmp_path: Path) -> None:
    table = tmp_path / "table.csv"
    done = recorded.log("export", recorded.folder, "--output", table, "--progress")
    assert done.returncode == OK and done.stdout == ""
    *lines, last = done.stderr.splitlines()
    shown = [re.match(r"ecdaq-.*: +(\d+) %  \d+\.\d MiB/s  \d+:\d\d left$", one) for one in lines]
    assert shown and all(shown)
    assert all(0 <= int(one.group(1)) <= 100 for one in shown if one)
    assert re.match(rf"{table}: {CYCLES} rows, \d+\.\d MiB, \d+\.\d s$", last)
    assert len(table.read_text().splitlines()) == 1 + CYCLES
    checked = recorded.log("check", recorded.folder, "--progress")
    assert re.search(r"\n1 files checked, \d+\.\d s\n$", checked.stderr)


def test_into_a_pipe_there_is_no_progress(recorded: Bench) -> None:
    for words in (["check"], ["export"], ["export", "--json"]):
        done = recorded.log(*words, recorded.folder)
        assert done.returncode == OK and done.stderr == ""


def test_on_a_terminal_the_end_is_a_line_with_file_rows_and_size(
    recorded: Bench, terminal: Terminal, tmp_path: Path
) -> None:
    table = tmp_path / "t.csv"
    terminal.start_on(["log", "export", recorded.folder, "--output", table])
    assert terminal.process is not None and terminal.process.wait(60) == OK
    terminal.wait_for(rf"t\.csv: {CYCLES} rows, \d+\.\d MiB, \d+\.\d s\r\n")
