# SPDX-License-Identifier: MIT
"""ecdaq.read() against independent readers: values, gaps, selection."""

from __future__ import annotations

import datetime
import operator
import struct
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import ecdaq
import numpy as np
import pandas
import pytest
from ecdaq.container import FormError
from ecdaq.messages import TIME, Joined, join
from made import (
    BIN,
    KIT,
    PERIOD_NS,
    decoded,
    files,
    make,
    message,
    metadata_of,
    run,
    topic,
    unfinished,
)

OLD_RECORDING = (
    Path(__file__).parents[1] / "cli" / "recordings" / "bad_slaves_in_one_word.mcap"
)  # fmt: skip


def plain(value: object) -> object:
    """A decoded value in the form that the kit gives it."""
    return list(value) if isinstance(value, bytes | list | tuple) else value


def assert_topics_are_equal(path: Path) -> None:
    recording = ecdaq.read(path)
    for name, messages in decoded(path).items():
        columns = recording.topic(name)
        assert columns.pop("log_time_ns").tolist() == [time for time, _ in messages]
        for field, values in columns.items():
            expected = [plain(operator.attrgetter(field)(m)) for _, m in messages]
            assert repr([plain(v) for v in values.tolist()]) == repr(expected), f"{name} {field}"
        assert {column.split(".")[0] for column in columns} == set(messages[0][1].__slots__)


@pytest.mark.parametrize("compression", ["0", "3"])
def test_every_topic_is_equal_to_what_the_package_mcap_reads(
    recorded: Callable[..., Path], compression: str
) -> None:
    folder = recorded(
        "--cycles", "1500", "--events", "40", "--bad", "7", "--skip", "500:3",
        settings=(f"record.compression={compression}",),
    )  # fmt: skip
    (path,) = files(folder)
    assert_topics_are_equal(path)


def test_recordings_of_earlier_versions_are_read() -> None:
    assert_topics_are_equal(OLD_RECORDING)
    recording = ecdaq.read(OLD_RECORDING)
    valid = recording["piccolo1.adc"].valid
    assert np.flatnonzero(~valid).tolist() == [0, 5, 10, 15]


def test_values_are_physical_and_missing_where_a_sample_is_not_good(sample: Path) -> None:
    (path,) = files(sample)
    frame = ecdaq.read(sample).to_pandas()
    topics = decoded(path)
    for slave in ("piccolo0", "piccolo1"):
        messages = topics[f"/ecdaq/{slave}"]
        metadata = metadata_of(path, f"/ecdaq/{slave}")
        rows = frame.loc[frame["cycle"].isin([m.cycle for _, m in messages])]
        assert rows.index.asi8.tolist() == [time for time, _ in messages]
        for field in ("adc", "counter", "sample_time"):
            scale, offset = (float(metadata[f"{field}.{n}"]) for n in ("scale", "offset"))
            expected = [getattr(m, field) if m.good else None for _, m in messages]
            if scale != 1:
                expected = [None if v is None else v * scale + offset for v in expected]
            found = rows[f"{slave}.{field}"].astype(object)
            assert found.where(found.notna(), None).tolist() == expected
    bad = frame["piccolo1.adc"].isna() & frame["piccolo0.adc"].notna()
    assert frame.loc[bad, "cycle"].tolist() == [n for n in range(0, 3000, 50) if n != 300]
    assert frame["piccolo0.sample_time"].dtype == pandas.UInt64Dtype()
    assert frame.attrs["units"]["piccolo0.adc"] == "V"


def test_values_equal_those_of_the_export(sample: Path, tmp_path: Path) -> None:
    run(BIN / "ecdaq", "log", "export", "--output", tmp_path / "all.csv", *files(sample))
    exported = pandas.read_csv(tmp_path / "all.csv")
    frame = ecdaq.read(sample).to_pandas()
    frame = frame[frame["cycle"].isin(exported["cycle"])]
    for name, unit in frame.attrs["units"].items():
        title = f"{name} [{unit}]" if unit else name
        found = frame[name].astype("float64").to_numpy()
        assert np.allclose(found, exported[title].astype("float64"), rtol=1e-8, equal_nan=True), (
            name
        )


def test_raw_values_are_those_of_the_process_image(sample: Path) -> None:
    (path,) = files(sample)
    recording = ecdaq.read(path, "piccolo1.adc", raw=True)
    signal = recording["piccolo1.adc"]
    assert signal.unit == ""
    expected = {m.cycle: m.adc_raw for _, m in decoded(path)["/ecdaq/piccolo1"]}
    assert (
        dict(zip(signal.cycle[signal.valid], signal.exact[signal.valid], strict=True)) == expected
    )


@pytest.mark.parametrize("values", ["physical", "raw", "both"])
def test_values_are_the_same_however_they_were_recorded(
    recorded: Callable[..., Path], values: str
) -> None:
    folder = recorded("--cycles", "200", "--bad", "7", settings=(f"record.values={values}",))
    (path,) = files(folder)
    signal = ecdaq.read(path)["piccolo1.adc"]
    counts = np.round(signal.values[signal.valid] * 4096 / 3.3)
    assert signal.unit == "V"
    assert np.allclose(signal.values[signal.valid], counts * 3.3 / 4096)
    assert np.flatnonzero(~signal.valid).tolist() == list(range(0, 200, 7))
    names = set(decoded(path)["/ecdaq/piccolo1"][0][1].__slots__)
    assert ("adc_raw" in names) == (values == "both")
    if values == "physical":
        with pytest.raises(ecdaq.RecordingError, match="recorded as physical values only"):
            ecdaq.read(path, "piccolo1.adc", raw=True)["piccolo1.adc"]
        assert ecdaq.read(path, "piccolo1.counter", raw=True)["piccolo1.counter"].valid.all()
    else:
        raw = ecdaq.read(path, raw=True)["piccolo1.adc"]
        assert np.array_equal(raw.exact[signal.valid], counts)


def test_a_gap_is_rows_without_values_and_an_entry_in_the_list(sample: Path) -> None:
    recording = ecdaq.read(sample)
    table = recording.table
    assert table.cycle.tolist() == list(range(3000))
    assert set(np.diff(table.utc_ns)) == {PERIOD_NS}
    assert set(np.diff(table.dc_time_ns)) == {PERIOD_NS}
    for column in table.columns.values():
        assert not column.valid[300:307].any()
    assert [(g.slave, g.first_cycle, g.count) for g in recording.gaps] == [("", 300, 7)]
    assert recording.gaps[0].end_utc_ns - recording.gaps[0].start_utc_ns == 8 * PERIOD_NS


def test_a_long_gap_has_two_rows(recorded: Callable[..., Path]) -> None:
    folder = recorded("--cycles", "400000", "--skip", "100:399800", "--depth", "1024")
    recording = ecdaq.read(folder)
    (gap,) = recording.gaps
    assert (gap.first_cycle, gap.count) == (100, 399800)
    assert recording.table.cycle[99:103].tolist() == [99, 100, 399899, 399900]
    assert np.isnan(recording["piccolo0.adc"].values[100:102]).all()
    inside = ecdaq.read(folder, cycles=(150, 200000))
    assert [(g.first_cycle, g.count) for g in inside.gaps] == [(150, 199851)]
    start = int(recording.table.utc_ns[99])
    later = ecdaq.read(folder, utc=(start + 1000 * PERIOD_NS, None))
    assert [(g.first_cycle, g.count) for g in later.gaps] == [(1099, 398801)]


def test_many_files_and_sessions_are_one_table(recorded: Callable[..., Path]) -> None:
    small = ("record.rotate_size=64KiB", "record.compression=0")
    folder = recorded("--cycles", "2000", settings=small)
    recorded("--cycles", "500", "--first", "100", settings=small)
    assert len(files(folder)) > 3
    recording = ecdaq.read(folder)
    table = recording.table
    assert table.cycle.tolist() == [*range(2001), *range(100, 600)]
    assert len(set(table.session.tolist())) == 2
    (gap,) = recording.gaps
    assert (gap.count, gap.first_cycle, gap.session) == (0, 100, int(table.session[-1]))
    assert np.flatnonzero(~table.columns["piccolo1.led"].valid).tolist() == [2000]


@pytest.mark.parametrize("is_finished", [True, False])
def test_selection_by_cycle_utc_and_dc_gives_the_same_rows(
    recorded: Callable[..., Path], is_finished: bool
) -> None:
    small = ("record.rotate_size=64KiB", "record.compression=0")
    folder = recorded("--cycles", "2000", "--skip", "700:50", settings=small)
    if not is_finished:
        last_file = files(folder)[-1]
        last_file.rename(f"{last_file}.part")
    everything = ecdaq.read(folder).table
    for first, last in ((0, 1999), (1, 1), (330, 1234), (720, 730), (699, 720), (745, 1999)):
        expected = (everything.cycle >= first) & (everything.cycle <= last)
        utc = everything.utc_ns[expected]
        dc = everything.dc_time_ns[expected]
        for span in (
            {"cycles": (first, last)},
            {"utc": (int(utc[0]), int(utc[-1]))},
            {"utc": (np.datetime64(int(utc[0]), "ns"), np.datetime64(int(utc[-1]), "ns"))},
            {"utc": (pandas.Timestamp(utc[0]), pandas.Timestamp(utc[-1]).isoformat() + "Z")},
            {"dc_ns": (int(dc[0]), int(dc[-1]))},
        ):
            found = ecdaq.read(folder, **span).table
            assert found.cycle.tolist() == list(range(first, last + 1)), span
            for name, column in found.columns.items():
                whole = everything.columns[name]
                assert np.array_equal(
                    column.values, whole.values[expected], equal_nan=column.values.dtype.kind == "f"
                )
            low, high = max(first, 700), min(last, 749)
            gaps = [(g.first_cycle, g.count) for g in found.gaps]
            assert gaps == ([(low, high - low + 1)] if low <= high else []), span


def test_utc_is_understood_in_every_form(sample: Path) -> None:
    whole = ecdaq.read(sample).table
    at = int(whole.utc_ns[1000]) // 1000 * 1000
    moment = datetime.datetime.fromtimestamp(at // 10**9, datetime.UTC).replace(
        microsecond=at % 10**9 // 1000
    )
    zone = datetime.timezone(datetime.timedelta(hours=2))
    for form in (at, moment, moment.replace(tzinfo=None), moment.isoformat(),
                 moment.astimezone(zone), moment.astimezone(zone).isoformat()):  # fmt: skip
        assert ecdaq.read(sample, utc=(form, None)).table.cycle[0] in (1000, 999 + 2), form


def test_channels_are_selected_by_name_pattern_and_slave(sample: Path) -> None:
    def names(**how: object) -> list[str]:
        return [c.name for c in ecdaq.read(sample, **how).channels]  # type: ignore[arg-type]

    assert names(channels="piccolo1.led") == ["piccolo1.led"]
    assert names(channels="*.adc") == ["piccolo0.adc", "piccolo1.adc"]
    assert names(channels=["piccolo0.adc", "*.led"]) == ["piccolo0.adc", "piccolo1.led"]
    assert names(slaves="piccolo0") == [f"piccolo0.{n}" for n in ("adc", "counter", "sample_time")]
    assert list(ecdaq.read(sample).select("*.led").table.columns) == ["piccolo1.led"]
    for wrong in (
        {"channels": "piccolo9.adc"},
        {"slaves": "x"},
        {"slaves": "piccolo0", "channels": "*.led"},
    ):
        with pytest.raises(ValueError, match="there are: "):
            names(**wrong)
    with pytest.raises(ValueError, match="no topic /x: there are: /ecdaq/cycle"):
        ecdaq.read(sample).topic("/x")


def test_a_file_still_being_written_is_read_to_its_last_complete_chunk(
    sample: Path, tmp_path: Path
) -> None:
    (path,) = files(sample)
    content = path.read_bytes()
    whole = ecdaq.read(path).table
    counts = set()
    for size in range(len(content) // 2, len(content) - 2000, len(content) // 50):
        part = tmp_path / f"{path.name}.part"
        part.write_bytes(content[:size])
        table = ecdaq.read(part).table
        counts.add(len(table))
        assert np.array_equal(table.cycle, whole.cycle[: len(table)])
        for name, column in table.columns.items():
            assert np.array_equal(column.valid, whole.columns[name].valid[: len(table)])
            assert np.array_equal(
                column.as_float(), whole.columns[name].as_float()[: len(table)], equal_nan=True
            )
    assert len(counts) > 3
    finished = tmp_path / path.name
    part.rename(finished)
    with pytest.raises(ecdaq.RecordingError, match="no summary at its end: cut off"):
        _ = ecdaq.read(finished).channels


def test_a_part_that_was_renamed_meanwhile_is_read(sample: Path, tmp_path: Path) -> None:
    (path,) = files(sample)
    part = tmp_path / f"{path.name}.part"
    part.write_bytes(path.read_bytes())
    recording = ecdaq.read(tmp_path)
    part.rename(tmp_path / path.name)
    assert len(recording.table) == 3000


def test_a_definition_with_a_header_nested_types_and_physical_fields_is_followed(
    tmp_path: Path,
) -> None:
    """Another layout than that of recordings: the definition in the file says where fields are."""
    schema = """\
uint8 VERSION=2
std_msgs/Header header
uint64 cycle
int64 dc_time_ns
uint32 flags
bool good
float64 adc  # physical
uint8[3] trio
uint16[<=4] some
uint16 adc_raw
Pair pair
===
MSG: test_msgs/Pair
int8 left
float32[] right
"""
    metadata = {
        "slave": "s", "adc.channel": "s.adc", "adc.unit": "V", "adc.raw": "adc_raw",
        "adc_raw.channel": "s.adc", "adc_raw.scale": "0.5",
    }  # fmt: skip
    content = topic(7, "/ecdaq/s", schema, metadata)
    for n in range(10):
        content += message(7, 1000 + n, encode(n))
    path = tmp_path / "x.mcap.part"
    path.write_bytes(unfinished([content]))
    recording = ecdaq.read(path)
    columns = recording.topic("/ecdaq/s")
    assert columns["header.stamp.sec"].tolist() == [5] * 10
    assert columns["header.frame_id"].tolist() == ["ab" if n % 2 else "a" for n in range(10)]
    assert columns["trio"].tolist() == [[1, 2, 3]] * 10
    assert columns["some"].tolist() == [[8, 9]] * 10
    assert columns["pair.left"].tolist() == [-n for n in range(10)]
    assert [v.tolist() for v in columns["pair.right"]] == [[0.5] * (n % 3) for n in range(10)]
    assert columns["adc_raw"].tolist() == [77] * 10
    assert ecdaq.read(path, raw=True)["s.adc"].exact.tolist() == [77] * 10
    signal = recording["s.adc"]
    assert (signal.unit, signal.cycle.tolist()) == ("V", list(range(10)))
    assert np.array_equal(
        signal.values, [n / 8 if n != 4 else np.nan for n in range(10)], equal_nan=True
    )


def encode(n: int) -> bytes:
    """Message n of the test above, field by field."""
    found = bytearray()

    def put(code: str, *values: object) -> None:
        for value in values:
            size = struct.calcsize(code)
            found.extend(bytes(-len(found) % size) + struct.pack(f"<{code}", value))

    def put_text(value: bytes) -> None:
        put("I", len(value) + 1)
        found.extend(value + b"\0")

    put("i", 5)
    put("I", n)
    put_text(b"ab" if n % 2 else b"a")
    put("Q", n)
    put("q", n * 1000)
    put("I", 0)
    put("B", n != 4)
    put("d", n / 8)
    put("B", 1, 2, 3)
    put("I", 2)
    put("H", 8, 9, 77)
    put("b", -n)
    put("I", n % 3)
    put("f", *[0.5] * (n % 3))
    return b"\0\1\0\0" + bytes(found)


def test_reading_needs_neither_dds_nor_the_package_mcap(sample: Path) -> None:
    code = (
        "import sys\n"
        "for name in ('cyclonedds', 'mcap', 'pandas', 'pyarrow', 'h5py', 'nptdms', 'matplotlib'):\n"
        "    sys.modules[name] = None\n"
        f"sys.path.insert(0, {str(KIT)!r})\n"
        "import ecdaq\n"
        f"recording = ecdaq.read({str(sample)!r})\n"
        "assert len(recording['piccolo0.adc']) == 3000\n"
        "for call in (recording.to_pandas, recording.to_arrow, recording.plot,\n"
        "    lambda: recording.to_hdf5('x'), lambda: recording.to_tdms('x')):\n"
        "    try:\n"
        "        call()\n"
        "    except ecdaq.MissingExtraError as error:\n"
        "        print(error)\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    extras = ("pandas", "arrow", "plot", "hdf5", "tdms")
    lines = done.stdout.splitlines()
    assert [line.partition("pip install ")[2] for line in lines] == [
        f"'ecdaq[{e}]'" for e in extras
    ]


def test_two_producers_in_one_folder_are_two_sessions(tmp_path: Path) -> None:
    folder = make(tmp_path / "records", ("--cycles", "10"))
    make(folder, ("--cycles", "10"))
    assert len(ecdaq.read(folder).gaps) == 1


def test_parts_are_joined_as_they_come_alike_or_not() -> None:
    alike = [
        {TIME: np.arange(n, n + 700), "x": np.full(700, float(n))} for n in range(0, 2100, 700)
    ]
    other = {TIME: np.arange(2100, 2103), "x": np.array([1, 2, 3], np.int16)}
    less = {TIME: np.arange(2103, 2104)}
    for parts in (alike, [*alike, other], [*alike, other, less, *alike], [less, *alike]):
        joined = Joined(0)
        for part in parts:
            joined.add(part)
        found, expected = joined.columns(), join(parts)
        assert found.keys() == expected.keys()
        for name, values in expected.items():
            assert found[name].dtype == values.dtype and found[name].tolist() == values.tolist()


def test_a_record_that_is_cut_off_is_no_chunk(recorded: Callable[..., Path]) -> None:
    (file,) = ecdaq.read(recorded("--cycles", "300"))._files
    chunk = file.chunks[0]
    record = file.source.read(chunk.offset, chunk.length)
    assert len(file.read_chunk(chunk, record)) == chunk.size
    for size in (0, 8, 40, chunk.content_at, len(record) - 1):
        with pytest.raises(FormError, match="no chunk at byte"):
            file.read_chunk(chunk, memoryview(record)[:size])
