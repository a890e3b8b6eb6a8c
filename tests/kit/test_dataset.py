# SPDX-License-Identifier: MIT
"""ecdaq-parquet: recordings of many appliances, converted once each, queried by DuckDB."""

from __future__ import annotations

import errno
import os
import re
from collections.abc import Callable
from pathlib import Path

import duckdb
import ecdaq
import pyarrow.parquet as parquet
import pytest
from ecdaq import dataset
from made import ROOT

Make = Callable[..., Path]
PAGE = ROOT / "app/doc/how-to/query-a-fleet.md"
CYCLES = 3000
SMALL_FILES = ("record.rotate_size=64KiB", "record.compression=0")
# Appliance, and what its recorder did not get: first cycle and count.
SKIPPED = {"bench-1": (300, 7), "bench-2": (0, 0), "mill_3": (1000, 500)}


@pytest.fixture
def fleet(recorded: Make, tmp_path: Path) -> Path:
    """A folder with one for each appliance, in several files."""
    for name, (first, count) in SKIPPED.items():
        options = ["--cycles", str(CYCLES)]
        if count:
            options += ["--skip", f"{first}:{count}"]
        recorded(*options, folder=f"fleet-{name}", settings=SMALL_FILES)
        (tmp_path / "fleet").mkdir(exist_ok=True)
        (tmp_path / f"fleet-{name}").rename(tmp_path / "fleet" / name)
    return tmp_path / "fleet"


def convert(source: Path, target: Path, *more: str) -> int:
    return dataset.main([str(source), str(target), *more])


def query(target: Path, sql: str) -> list[tuple]:
    was = Path.cwd()
    os.chdir(target)
    try:
        # Instants need pytz in fetchall().
        rows = duckdb.sql(sql).to_arrow_table().to_pylist()
        return [tuple(row.values()) for row in rows]
    finally:
        os.chdir(was)


def block(title: str) -> str:
    """The SQL of a section of the page."""
    (found,) = re.findall(rf"^## {title}\n.*?```sql\n(.*?)```", PAGE.read_text(), re.M | re.S)
    return found


def test_every_sample_of_all_appliances_is_in_one_query(fleet: Path, tmp_path: Path) -> None:
    target = tmp_path / "lake"
    assert convert(fleet, target) == 0
    rows = query(target, block("How many samples"))
    assert {name: count for name, count, *_ in rows} == {
        name: CYCLES - count for name, (_, count) in SKIPPED.items()
    }
    frame = ecdaq.read(fleet / "bench-2").to_pandas()
    wanted = (frame["piccolo0.adc"].min(), frame["piccolo0.adc"].max())
    (found,) = query(
        target,
        """select min("piccolo0.adc"), max("piccolo0.adc")
           from read_parquet('samples/*/*/*.parquet', hive_partitioning=true)
           where appliance = 'bench-2'""",
    )
    assert found == wanted


def test_the_largest_value_of_each_hour_is_that_of_the_recordings(
    fleet: Path, tmp_path: Path
) -> None:
    target = tmp_path / "lake"
    assert convert(fleet, target) == 0
    rows = query(target, block("The largest value of every hour"))
    for name in SKIPPED:
        frame = ecdaq.read(fleet / name).to_pandas()
        hours = frame["piccolo0.adc"].groupby(frame.index.floor("h")).max()
        assert [adc for found, _, adc in rows if found == name] == hours.to_list()


def test_lost_samples_are_counted_over_the_ends_of_files(fleet: Path, tmp_path: Path) -> None:
    target = tmp_path / "lake"
    # A whole file that never arrived is missing as well.
    lost = sorted((fleet / "bench-1").glob("*.mcap"))[1]
    in_it = len(ecdaq.read(lost).to_pandas())
    assert in_it > 0
    lost.unlink()
    assert convert(fleet, target) == 0
    wanted = {name: count for name, (_, count) in SKIPPED.items()}
    wanted["bench-1"] += in_it
    missing = {name: count for name, _, count in query(target, block("What is missing"))}
    assert missing == wanted


def test_a_second_run_converts_only_what_is_new_or_has_changed(
    fleet: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    target = tmp_path / "lake"
    files = len(list(fleet.rglob("*.mcap")))
    assert files >= 6
    kept = sorted((fleet / "mill_3").glob("*.mcap"))[-1]
    later = tmp_path / kept.name
    kept.rename(later)
    assert convert(fleet, target) == 0
    assert f"{files - 1} recordings converted" in capsys.readouterr().out
    before = {path: path.stat().st_mtime_ns for path in target.rglob("*.parquet")}
    later.rename(kept)
    changed = sorted((fleet / "bench-2").glob("*.mcap"))[0]
    os.utime(changed, ns=(0, 0))
    assert convert(fleet, target) == 0
    assert "2 recordings converted" in (said := capsys.readouterr().out)
    assert f"{files - 2} were there" in said
    touched = {path for path, at in before.items() if path.stat().st_mtime_ns != at}
    assert {path.stem for path in touched} == {changed.stem}
    assert len(list(target.rglob("*.parquet"))) == 2 * files
    rows = query(target, block("How many samples"))
    assert sum(count for _, count, *_ in rows) == 3 * CYCLES - 507


@pytest.mark.parametrize("fails_at", range(1, 5))
def test_after_an_interruption_nothing_is_missing_or_doubled(
    fleet: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, fails_at: int
) -> None:
    target = tmp_path / "lake"
    write, calls = dataset.write, [0]

    def interrupted(arrow: object, path: Path) -> None:
        calls[0] += 1
        if calls[0] == fails_at:
            raise KeyboardInterrupt
        write(arrow, path)

    monkeypatch.setattr(dataset, "write", interrupted)
    assert convert(fleet, target) == 1
    assert calls[0] == fails_at
    monkeypatch.undo()
    assert convert(fleet, target) == 0
    rows = query(target, block("How many samples"))
    assert {name: count for name, count, *_ in rows} == {
        name: CYCLES - count for name, (_, count) in SKIPPED.items()
    }
    assert not list(target.rglob(".*.parquet*"))


def test_a_damaged_recording_is_named_and_the_others_are_converted(
    fleet: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    target = tmp_path / "lake"
    bad = sorted((fleet / "bench-1").glob("*.mcap"))[0]
    data = bytearray(bad.read_bytes())
    data[len(data) // 2] ^= 1
    bad.write_bytes(data)
    assert convert(fleet, target) == 1
    said = capsys.readouterr()
    assert said.err.count("\n") == 1 and str(bad) in said.err
    assert "1 failed" in said.out
    assert {name for name, *_ in query(target, block("How many samples"))} == set(SKIPPED)


def test_a_recording_that_goes_during_the_conversion_does_not_stop_it(
    fleet: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """The recorder's budget removes the oldest ones."""
    gone = sorted((fleet / "bench-1").glob("*.mcap"))[0]
    found = dataset.recordings(fleet, None)
    monkeypatch.setattr(dataset, "recordings", lambda *_: found)
    gone.unlink()
    assert convert(fleet, tmp_path / "lake") == 1
    said = capsys.readouterr()
    assert said.err == f"ecdaq-parquet: {gone}: No such file or directory\n"
    assert f"{len(found) - 1} recordings converted" in said.out


def test_two_recordings_of_one_name_are_refused(
    fleet: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    one = sorted((fleet / "bench-1").glob("*.mcap"))[0]
    (one.parent / "copy").mkdir()
    (one.parent / "copy" / one.name).write_bytes(one.read_bytes())
    assert convert(fleet, tmp_path / "lake") == 1
    assert "has the same name" in capsys.readouterr().err


def test_a_full_disk_is_one_line_and_the_next_run_goes_on(
    fleet: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    target, write, calls = tmp_path / "lake", parquet.write_table, [0]

    def full(arrow: object, part: Path, **options: str) -> None:
        """As pyarrow: without the name of the file, a part of which is there."""
        calls[0] += 1
        if calls[0] == 3:
            part.write_bytes(b"PAR1")
            raise OSError(errno.ENOSPC, "Error writing bytes to file.")
        write(arrow, part, **options)

    monkeypatch.setattr(parquet, "write_table", full)
    assert convert(fleet, target) == 1
    error = capsys.readouterr().err
    assert error.endswith(".parquet: No space left on device\n") and error.count("\n") == 1
    assert str(target / "samples") in error
    assert not list(target.rglob(".*.parquet*"))
    monkeypatch.undo()
    assert convert(fleet, target) == 0
    rows = query(target, block("How many samples"))
    assert sum(count for _, count, *_ in rows) == 3 * CYCLES - 507


def test_one_appliance_is_named_on_the_command_line(fleet: Path, tmp_path: Path) -> None:
    target = tmp_path / "lake"
    assert convert(fleet / "bench-1", target, "--appliance", "here") == 0
    assert [name for name, *_ in query(target, block("How many samples"))] == ["here"]


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda folder: folder / "none", "no such folder"),
        (lambda folder: folder, "no finished recordings"),
        (lambda folder: (folder / "a'b").mkdir() or folder, "is no name of an appliance"),
    ],
)
def test_a_source_that_cannot_be_used_is_one_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], make: Callable[[Path], Path], said: str
) -> None:
    folder = tmp_path / "empty"
    folder.mkdir()
    assert convert(make(folder), tmp_path / "lake") == 1
    error = capsys.readouterr().err
    assert said in error and error.count("\n") == 1


def test_two_at_a_time_do_not_write_to_one_target(
    fleet: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with dataset.locked(tmp_path / "lake"):
        assert convert(fleet, tmp_path / "lake") == 1
    assert "another ecdaq-parquet writes to it" in capsys.readouterr().err
