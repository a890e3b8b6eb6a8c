# SPDX-License-Identifier: MIT
"""Long work on recordings shows how far it is, and at the end what was done."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from ecdaq import BUILD, OK, STAGE, Fake, works
from recording import Bench
from terminal import Terminal

CYCLES = 3000
SII = STAGE / "share/ecdaq/fb1111_piccolo/fb1111_piccolo.bin"


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
    (file,) = recorded.files()
    for words in (["check"], ["export"], ["export", "--json"], ["recover"]):
        done = recorded.log(*words, file if words == ["recover"] else recorded.folder)
        assert done.returncode == OK and done.stderr == ""


def test_on_a_terminal_the_end_is_a_line_with_file_rows_and_size(
    recorded: Bench, terminal: Terminal, tmp_path: Path
) -> None:
    table = tmp_path / "t.csv"
    terminal.start_on(["log", "export", recorded.folder, "--output", table])
    assert terminal.process is not None and terminal.process.wait(60) == OK
    terminal.wait_for(rf"t\.csv: {CYCLES} rows, \d+\.\d MiB, \d+\.\d s\r\n")


def shown_and_last(stderr: str, unit: str) -> tuple[list[int], str]:
    """The per cent of each line, and the line at the end."""
    *lines, last = stderr.splitlines()
    shown = [re.match(rf".*: +(\d+) %  \d+(\.\d)? {unit}/s  \d+:\d\d left$", one) for one in lines]
    assert shown and all(shown), stderr
    return [int(one.group(1)) for one in shown if one], last


def cut(recorded: Bench) -> Path:
    """The recording as after a power cut."""
    (whole,) = recorded.files()
    part = whole.with_suffix(".part")
    part.write_bytes(whole.read_bytes()[:-200])
    whole.unlink()
    return part


def test_recovery_shows_how_far_it_is_and_what_there_is_at_the_end(recorded: Bench) -> None:
    part = cut(recorded)
    done = recorded.log("recover", part, "--progress")
    assert done.returncode == OK and ": repaired: " in done.stdout
    shown, last = shown_and_last(done.stderr, "MiB")
    assert shown == sorted(shown) and shown[-1] <= 100
    whole = part.with_suffix(".mcap")
    size = whole.stat().st_size / 2**20
    assert re.match(rf"{whole}: {CYCLES} cycles, {size:.1f} MiB, \d+\.\d s$", last)


def test_a_recovery_to_a_copy_reads_twice_and_counts_so(recorded: Bench, tmp_path: Path) -> None:
    part, copy = cut(recorded), tmp_path / "copy.mcap"
    done = recorded.log("recover", part, "--output", copy, "--progress")
    assert done.returncode == OK
    shown, last = shown_and_last(done.stderr, "MiB")
    assert shown[0] <= 50 and shown[-1] <= 100
    assert re.match(rf"{copy}: {CYCLES} cycles, \d+\.\d MiB, \d+\.\d s$", last)


def test_a_failed_recovery_has_no_line_of_success(recorded: Bench, tmp_path: Path) -> None:
    other = tmp_path / "other.mcap"
    other.write_bytes(b"not a recording" * 1000)
    done = recorded.log("recover", other, "--progress")
    assert done.returncode != OK
    assert done.stderr.splitlines()[-1].startswith("ecdaq: log: ")
    assert "cycles" not in done.stderr


def test_a_scan_counts_slaves_and_ends_with_file_and_size(tmp_path: Path) -> None:
    """Reading each slave is a transfer of its own, which must not end the progress of the whole."""
    many = Fake(tmp_path, f"SII={SII}", program=BUILD / "tests/cli/test_fake_daemon_64")
    file = tmp_path / "bus.yaml"
    done = many("scan", "--write", str(file), "--progress")
    again = works(many("scan", "--write", str(file), "--force"))
    many.close()
    size = file.stat().st_size
    assert done.returncode == OK and done.stdout == again
    assert re.match(rf"{file}: 64 slaves, {size / 1024:.1f} KiB\n$", again)
    shown, _ = shown_and_last(done.stderr + "\n", "slaves")
    assert len(shown) < 32 and shown == sorted(shown)
