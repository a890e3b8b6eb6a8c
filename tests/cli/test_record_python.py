# SPDX-License-Identifier: MIT
"""ecdaq-record on a ring without a bus, its recordings read by independent software."""

from __future__ import annotations

import csv
import io
import itertools
import json
import os
import re
import shutil
import signal
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from catkin_pkg.package import parse_package
from ecdaq import NOBODY
from mcap.reader import make_reader
from recording import RECORD, Bench, wait_until
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

OLD_RECORDING = Path(__file__).parent / "recordings" / "bad_slaves_in_one_word.mcap"
PERIOD_NS = 1_000_000
# More than a file has before its first sample: schemas, IDL, channel table.
HEAD = 30_000


def test_every_sample_decodes_and_is_what_the_ring_held(bench: Bench) -> None:
    bench.produce("--cycles", "3000", "--events", "3").wait(60)
    bench.record_all()
    cycles = list(bench.messages("/ecdaq/cycle"))
    assert [m.cycle for _, m in cycles] == list(range(3000))
    assert {b[0] - a[0] for a, b in itertools.pairwise(cycles)} == {PERIOD_NS}
    assert all(m.wkc == m.wkc_expected == 6 and m.round_trip_ns == 30000 for _, m in cycles)
    for slave in range(2):
        samples = list(bench.messages(f"/ecdaq/piccolo{slave}"))
        assert [m.cycle for _, m in samples] == list(range(3000))
        assert [t for t, _ in samples] == [t for t, _ in cycles]
        assert all(m.good and m.flags == 0 for _, m in samples)
        assert all(m.counter == m.cycle % 65536 for _, m in samples)
        assert all(m.sample_time == m.dc_time_ns for _, m in samples)
        assert all(m.adc == pytest.approx(m.adc_raw * 3.3 / 4096) for _, m in samples)
        assert all(m.header.stamp.sec * 10**9 + m.header.stamp.nanosec == t for t, m in samples)
        volt = np.array([m.adc for _, m in samples])
        angle = 2 * np.pi * (np.arange(3000) / 1000 - 0.25 * slave)
        basis = np.column_stack((np.sin(angle), np.cos(angle), np.ones(3000)))
        (sine, cosine, offset), *_ = np.linalg.lstsq(basis, volt, rcond=None)
        assert sine == pytest.approx(0.5, abs=1e-4)
        assert cosine == pytest.approx(0, abs=1e-4)
        assert offset == pytest.approx(1, abs=1e-4)
    assert [m.led for _, m in bench.messages("/ecdaq/piccolo1")][499:501] == [False, True]
    events = [m for _, m in bench.messages("/ecdaq/event")]
    assert [m.value for m in events if m.name == "output_set"] == [0, 1, 2]
    assert [m.name for m in events if m.sequence == 2**64 - 1] == ["record_started"]
    assert len(list(bench.messages("/ecdaq/timemap"))) >= 2


def bad_slaves(message: Any) -> list[int]:
    octets = message.slaves_bad
    return [n for n in range(len(octets) * 8) if octets[n // 8] >> n % 8 & 1]


def test_bad_slaves_are_octets_as_many_as_the_slaves_need(bench: Bench) -> None:
    bench.produce("--cycles", "20", "--bad", "5").wait(60)
    bench.record_all()
    cycles = [m for _, m in bench.messages("/ecdaq/cycle")]
    assert [m.cycle for m in cycles] == list(range(20))
    assert {len(m.slaves_bad) for m in cycles} == {1}
    assert [m.cycle for m in cycles if bad_slaves(m) == [1]] == [0, 5, 10, 15]
    assert [m.cycle for m in cycles if bad_slaves(m) == []] == [n for n in range(20) if n % 5]
    samples = [m for _, m in bench.messages("/ecdaq/piccolo1")]
    assert [m.cycle for m in samples if not m.good] == [0, 5, 10, 15]


def test_a_recording_with_bad_slaves_in_one_word_is_still_read(bench: Bench) -> None:
    shutil.copy(OLD_RECORDING, bench.folder)
    cycles = [m for _, m in bench.messages("/ecdaq/cycle")]
    assert [m.cycle for m in cycles if m.slaves_bad == 2] == [0, 5, 10, 15]
    checked = bench.log("check", "--json", *bench.files())
    assert checked.returncode == 0, checked.stderr
    assert '"cycles":20' in checked.stdout
    exported = bench.log("export", *bench.files())
    assert exported.returncode == 0, exported.stderr
    rows = list(csv.DictReader(io.StringIO(exported.stdout)))
    assert [row["cycle"] for row in rows if row["piccolo1.good"] == "0"] == ["0", "5", "10", "15"]
    assert all(row["piccolo0.good"] == "1" for row in rows)
    info = bench.log("info", *bench.files())
    assert info.returncode == 0, info.stderr


def test_an_unfinished_recording_with_bad_slaves_in_one_word_is_recovered(bench: Bench) -> None:
    cut = bench.folder / f"{OLD_RECORDING.name}.part"
    cut.write_bytes(OLD_RECORDING.read_bytes()[:-200])
    recovered = bench.log("recover", cut)
    assert recovered.returncode == 0, recovered.stderr
    cycles = [m for _, m in bench.messages("/ecdaq/cycle")]
    assert [m.cycle for m in cycles] == list(range(20))


def test_the_file_describes_itself(bench: Bench, tmp_path: Path) -> None:
    config = tmp_path / "ecdaq.yaml"
    config.write_text("# as on the appliance\nrecord:\n  compression: 0\n")
    bench.produce("--cycles", "100").wait(60)
    bench.record_all("--config", str(config))
    with bench.files()[0].open("rb") as file:
        reader = make_reader(file)
        assert reader.get_header().profile == "ros2"
        metadata = {record.name: record.metadata for record in reader.iter_metadata()}
        attachments = {a.name: a.data for a in reader.iter_attachments()}
        summary = reader.get_summary()
    assert metadata["ecdaq.config"]["yaml"] == config.read_text()
    table = json.loads(metadata["ecdaq.channels"]["json"])
    assert [c["name"] for c in table["channels"]][:2] == ["piccolo0.adc", "piccolo0.counter"]
    assert table["channels"][0]["unit"] == "V"
    assert metadata["ecdaq.end"]["cycles"] == "100"
    assert metadata["ecdaq.end"]["reason"] == "producer ended"
    assert int(metadata["ecdaq.timemap"]["utc_ns"]) > 1_600_000_000 * 10**9
    assert b"struct Piccolo0 {" in attachments["ecdaq.idl"]
    assert summary is not None and summary.statistics is not None
    assert summary.statistics.message_count == 3 * 100 + 1
    assert all(chunk.compression == "" for chunk in summary.chunk_indexes)


def test_killed_again_and_again_it_misses_no_cycle(bench: Bench) -> None:
    # As long as it takes to kill the recorder four times.
    producer = bench.produce("--cycles", "10000000", "--pace")
    wait_until("ring", (bench.run_dir / "samples").exists)
    for _ in range(4):
        before = bench.recorded_bytes()
        recorder = bench.record()
        wait_until(
            "recording", lambda before=before: bench.recorded_bytes() > before + HEAD + 20000
        )
        recorder.send_signal(signal.SIGKILL)
        assert recorder.wait(60) == -signal.SIGKILL
        assert list(bench.folder.glob("*.part"))
    producer.kill()
    producer.wait(60)
    output = bench.record_all()
    assert "recovered" in output
    assert not list(bench.folder.glob("*.part"))
    cycles = [m.cycle for _, m in bench.messages("/ecdaq/cycle")]
    assert cycles == list(range(len(cycles)))
    checked = bench.log("check", bench.folder)
    assert checked.returncode == 0, checked.stdout
    assert f"{len(cycles)} cycles, 0 gaps" in checked.stdout


def test_gaps_of_the_master_are_exact_events(bench: Bench) -> None:
    bench.produce("--cycles", "1000", "--skip", "300:7").wait(60)
    bench.record_all()
    gaps = [m for _, m in bench.messages("/ecdaq/event") if m.name == "record_gap"]
    assert [(m.value, m.arg0, m.severity) for m in gaps] == [(300, 7, "error")]
    checked = bench.log("check", bench.folder, "--json")
    assert checked.returncode == 1
    result = json.loads(checked.stdout)
    assert (result["gaps"], result["cycles_missing"], result["clean"]) == (1, 7, False)
    assert result["files"][0]["gaps"] == [{"first": 300, "count": 7}]


def test_export_is_read_by_csv_readers(bench: Bench) -> None:
    bench.produce("--cycles", "500").wait(60)
    bench.record_all("--set", "record.rotate_size=64KiB", "--set", "record.compression=0")
    assert len(bench.files()) > 1
    exported = bench.log("export", bench.folder, "--from", "100", "--to", "399")
    rows = list(csv.DictReader(io.StringIO(exported.stdout)))
    assert [int(row["cycle"]) for row in rows] == list(range(100, 400))
    assert float(rows[150]["piccolo0.adc [V]"]) == pytest.approx(1.5, abs=1e-3)
    assert rows[0]["piccolo1.counter"] == "100"
    raw = bench.log("export", bench.folder, "--raw", "--channels", "piccolo0.adc", "--json")
    lines = [json.loads(line) for line in raw.stdout.splitlines()]
    assert len(lines) == 500
    assert set(lines[0]) == {"cycle", "utc_ns", "piccolo0.adc"}
    assert lines[250]["piccolo0.adc"] == round(1.5 / 3.3 * 4096)
    missing = bench.log("export", bench.folder, "--channels", "piccolo9.adc")
    assert missing.returncode == 1
    assert missing.stderr.count("\n") == 1 and "no channel piccolo9.adc" in missing.stderr


@pytest.mark.parametrize("values", ["physical", "raw", "both"])
def test_the_table_is_the_same_however_values_were_recorded(bench: Bench, values: str) -> None:
    bench.produce("--cycles", "300", "--bad", "7").wait(60)
    bench.record_all("--set", f"record.values={values}")
    rows = list(csv.DictReader(io.StringIO(bench.log("export", bench.folder).stdout)))
    assert list(rows[0])[4:6] == ["piccolo0.good", "piccolo0.adc [V]"]
    assert float(rows[250]["piccolo0.adc [V]"]) == pytest.approx(1.5, abs=1e-3)
    assert [row["cycle"] for row in rows if row["piccolo1.adc [V]"] == ""] == [
        str(n) for n in range(0, 300, 7)
    ]
    raw = bench.log("export", bench.folder, "--raw", "--channels", "piccolo0.adc")
    if values == "physical":
        assert raw.returncode == 1 and raw.stderr.count("\n") == 1
        assert "piccolo0.adc was recorded as physical values only (record.values)" in raw.stderr
        raw = bench.log("export", bench.folder, "--raw", "--channels", "piccolo0.counter")
        assert raw.stdout.splitlines()[:2][0] == "cycle,utc_ns,piccolo0.counter"
    else:
        lines = raw.stdout.splitlines()
        assert lines[0] == "cycle,utc_ns,piccolo0.adc"
        assert lines[251].endswith(f",{round(1.5 / 3.3 * 4096)}")


def test_the_ros_2_package_defines_what_is_recorded(bench: Bench, tmp_path: Path) -> None:
    bench.produce("--cycles", "50").wait(60)
    bench.record_all()
    package = tmp_path / "ecdaq_msgs"
    made = bench.log("ros2pkg", *bench.files(), "--output", package)
    assert (made.returncode, made.stderr) == (0, "")
    assert made.stdout == f"{package}: package ecdaq_msgs, 6 message types\n"
    manifest = parse_package(str(package))
    manifest.validate()
    assert (manifest.name, manifest.get_build_type()) == ("ecdaq_msgs", "ament_cmake")
    assert [d.name for d in manifest.buildtool_depends][1:] == ["rosidl_default_generators"]
    listed = set(re.findall(r"msg/(\w+)\.msg", (package / "CMakeLists.txt").read_text()))
    store = get_typestore(Stores.ROS2_HUMBLE)
    types = {}
    for path in (package / "msg").iterdir():
        types |= get_types_from_msg(path.read_text(), f"ecdaq_msgs/msg/{path.stem}")
    assert {name.rpartition("/")[2] for name in types} == listed
    store.register(types)
    found = 0
    with bench.files()[0].open("rb") as file:
        for schema, channel, raw in make_reader(file).iter_messages():
            message: Any = store.deserialize_cdr(raw.data, schema.name)
            if channel.topic == "/ecdaq/piccolo0":
                found += 1
                assert message.adc == pytest.approx(message.adc_raw * 3.3 / 4096)
                stamp = message.header.stamp
                assert stamp.sec * 10**9 + stamp.nanosec == raw.log_time
    assert found == 50
    again = bench.log("ros2pkg", *bench.files(), "--output", package)
    assert again.returncode == 1
    assert again.stderr == f"ecdaq: log: {package}: File exists\n"


def test_a_package_is_not_made_of_recordings_that_differ(bench: Bench, tmp_path: Path) -> None:
    bench.produce("--cycles", "20").wait(60)
    bench.record_all()
    bench.produce("--cycles", "20").wait(60)
    bench.record_all("--set", "record.values=raw")
    first, second = bench.files()
    made = bench.log("ros2pkg", first, second, "--output", tmp_path / "made")
    assert made.returncode == 1
    assert made.stderr == (
        f"ecdaq: log: {second}: defines Piccolo0 other than a file before: a package for each\n"
    )
    assert not (tmp_path / "made").exists()


def test_stopped_by_a_signal_it_leaves_a_finished_file(bench: Bench) -> None:
    for number in (signal.SIGTERM, signal.SIGINT):
        bench.produce("--cycles", "1000", "--no-close").wait(60)
        recorder = bench.record()
        wait_until("file", lambda: bool(list(bench.folder.glob("*.part"))) or bool(bench.files()))
        recorder.send_signal(number)
        assert recorder.wait(60) == 0
        assert not list(bench.folder.glob("*.part"))
        assert [m.cycle for _, m in bench.messages("/ecdaq/cycle")] == list(range(1000))
        for path in bench.files():
            path.unlink()


def test_a_crashed_master_ends_the_session(bench: Bench) -> None:
    bench.produce("--cycles", "700", "--no-close").wait(60)
    output = bench.record_all()
    assert "producer gone" in output
    assert [m.cycle for _, m in bench.messages("/ecdaq/cycle")] == list(range(700))


def test_a_second_recorder_is_refused_in_one_line(bench: Bench) -> None:
    bench.record()
    wait_until("lock", lambda: bool((bench.folder / ".ecdaq-record.lock").exists()))
    wait_until("status", (bench.run_dir / "record/status").exists)
    second = bench.record()
    _, output = second.communicate(timeout=60)
    assert second.returncode == 6
    assert output.count("\n") == 1 and "another ecdaq-record (process " in output


@pytest.mark.parametrize(
    ("options", "code", "why"),
    [
        (["--loud"], 2, "--loud: unknown option"),
        (["--dir"], 2, "--dir: missing value"),
        (["somewhere"], 2, "somewhere: unexpected argument"),
        (["--set", "record.compression=99"], 3, "record.compression"),
        (["--set", "record.nothing=1"], 3, "record.nothing"),
        (["--config", "/nowhere/ecdaq.yaml"], 3, "/nowhere/ecdaq.yaml"),
        (["--dir", "/dev/null/records"], 1, "/dev/null/records: Not a directory"),
    ],
)
def test_an_error_is_one_line_and_a_code(options: list[str], code: int, why: str) -> None:
    ended = subprocess.run(
        [RECORD, *options], capture_output=True, text=True, timeout=60, check=False
    )
    assert ended.returncode == code
    assert ended.stderr.startswith("ecdaq-record: ")
    assert ended.stderr.count("\n") == 1 and why in ended.stderr


@pytest.mark.skipif(os.geteuid() != 0, reason="needs root to become somebody else")
def test_a_folder_that_may_not_be_written_is_reported(bench: Bench) -> None:
    folder = bench.run_dir / "records"
    folder.mkdir(mode=0o755)
    ended = subprocess.run(
        [RECORD, "--run-dir", bench.run_dir, "--dir", folder],
        capture_output=True, text=True, timeout=60, check=False, user=NOBODY, group=NOBODY,
    )  # fmt: skip
    assert ended.returncode == 4
    assert ended.stderr == f"ecdaq-record: {folder}: Permission denied\n"


def test_values_of_a_sample_that_is_not_good_are_not_exported(bench: Bench) -> None:
    bench.produce("--cycles", "20", "--bad", "5").wait(60)
    bench.record_all()
    rows = list(csv.DictReader(io.StringIO(bench.log("export", bench.folder).stdout)))
    rows = [{name.removesuffix(" [V]"): value for name, value in row.items()} for row in rows]
    bad = [row for row in rows if row["piccolo1.good"] == "0"]
    assert [row["cycle"] for row in bad] == ["0", "5", "10", "15"]
    assert {row[f"piccolo1.{name}"] for row in bad for name in ("adc", "counter", "led")} == {""}
    assert all(row["piccolo0.adc"] != "" for row in rows)
    assert all(row["piccolo1.adc"] != "" for row in rows if row not in bad)
    lines = [
        json.loads(line) for line in bench.log("export", bench.folder, "--json").stdout.splitlines()
    ]
    assert [line["cycle"] for line in lines if line["piccolo1.adc"] is None] == [0, 5, 10, 15]
    raw = list(csv.DictReader(io.StringIO(bench.log("export", bench.folder, "--raw").stdout)))
    assert all(row["piccolo1.adc"] != "" for row in raw)


def test_once_does_not_wait_for_a_ring_that_it_can_never_read(bench: Bench) -> None:
    (bench.run_dir / "samples").write_bytes(bytes(range(256)) * 64)
    process = bench.record("--once")
    _, said = process.communicate(timeout=60)
    assert process.returncode == 1
    assert said.count("not a sample ring, or damaged") == 1


def test_no_two_metadata_records_have_one_name(bench: Bench) -> None:
    bench.produce("--cycles", "100").wait(60)
    bench.record_all()
    with bench.files()[0].open("rb") as file:
        names = [record.name for record in make_reader(file).iter_metadata()]
    assert len(names) == len(set(names))
    assert {"ecdaq.timemap", "ecdaq.timemap_end"} <= set(names)
