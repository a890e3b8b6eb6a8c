# SPDX-License-Identifier: MIT
"""Damaged and foreign files: RecordingError with file and reason, or the recorded values."""

from __future__ import annotations

import random
from pathlib import Path

import ecdaq
import numpy as np
import pytest
from ecdaq.table import Table
from made import files, message, record, topic, unfinished

MUTANTS = 300
TOPICS = ("/ecdaq/cycle", "/ecdaq/event", "/ecdaq/timemap")
SCHEMA = "uint64 cycle\nint64 dc_time_ns\nuint32 flags\nbool good\nuint16 adc\n"
SLAVE = topic(1, "/ecdaq/s", SCHEMA, {"slave": "s", "adc.channel": "s.adc"})
DATA = b"\0\1\0\0" + bytes(24)


def mutated(content: bytes, random_: random.Random) -> bytes:
    """@content with one bit, one byte, or some bytes changed, taken out, doubled or zeroed."""
    changed = bytearray(content)
    # Half of them in head and summary, which are small.
    at = random_.choice(
        [random_.randrange(len(content)), random_.randrange(4096), -random_.randrange(1, 4096)]
    )
    at %= len(content)
    length = random_.choice([1, 2, 4, 8, 100, 5000])
    how = random_.randrange(6)
    if how == 0:
        changed[at] ^= 1 << random_.randrange(8)
    elif how == 1:
        changed[at] = random_.randrange(256)
    elif how == 2:
        changed[at : at + length] = random_.randbytes(length)
    elif how == 3:
        del changed[at : at + length]
    elif how == 4:
        changed[at:at] = changed[at : at + length]
    else:
        changed[at : at + length] = bytes(len(changed[at : at + length]))
    return bytes(changed)


def assert_equal(found: Table, whole: Table) -> None:
    """All that was found is as it was recorded, from the first cycle on."""
    rows = len(found)
    assert np.array_equal(found.cycle, whole.cycle[:rows])
    assert np.array_equal(found.utc_ns, whole.utc_ns[:rows])
    assert np.array_equal(found.dc_time_ns, whole.dc_time_ns[:rows])
    assert set(found.columns) <= set(whole.columns)
    for name, column in found.columns.items():
        expected = whole.columns[name]
        assert column.unit == expected.unit
        assert np.array_equal(column.valid, expected.valid[:rows])
        assert np.array_equal(column.as_float(), expected.as_float()[:rows], equal_nan=True)


@pytest.mark.parametrize("suffix", ["", ".part"])
def test_a_mutant_is_refused_or_has_the_recorded_values(
    sample: Path, tmp_path: Path, suffix: str
) -> None:
    (path,) = files(sample)
    content = path.read_bytes()
    if suffix:  # as left by a power cut: no summary
        content = content[: len(content) * 3 // 4]
    mutant = tmp_path / f"{path.name}{suffix}"
    mutant.write_bytes(content)
    whole = ecdaq.read(mutant).table
    topics = {name: ecdaq.read(mutant).topic(name) for name in TOPICS}
    random_ = random.Random(20261123)
    refused = read = 0
    for _ in range(MUTANTS):
        mutant.write_bytes(mutated(content, random_))
        recording = ecdaq.read(mutant)
        try:
            table = recording.table
            # A file cut off in its head has no topics yet.
            others = {name: recording.topic(name) for name in TOPICS if len(table) > 0}
        except ecdaq.RecordingError as error:
            assert str(error).startswith(f"{mutant}: ")
            assert "\n" not in str(error)
            refused += 1
            continue
        assert len(table) == len(whole) or suffix
        assert_equal(table, whole)
        for name, columns in others.items():
            for field, values in columns.items():
                assert values.tolist() == topics[name][field][: len(values)].tolist()
        read += 1
    assert refused > MUTANTS // 10
    assert read > MUTANTS // 20


@pytest.mark.parametrize(
    ("chunk", "reason"),
    [
        (SLAVE + message(1, 0, DATA[:20]), "too short"),
        (SLAVE + message(1, 0, DATA + bytes(40)), "a message of 68 bytes, by its definition 28"),
        (SLAVE + message(1, 0, b"\0\3" + DATA[2:]), "encapsulation 0x0003"),
        (SLAVE + message(1, 0, DATA)[:-1], "cut off"),
        (SLAVE + b"\0" * 20, "cut off"),
        (SLAVE + b"\5\1", "cut off"),
        (topic(1, "/chatter", "string data\n", {}), "not a recording of ecdaq"),
        (topic(1, "/ecdaq/s", "Nope x\n" + SCHEMA,
               {"slave": "s", "adc.channel": "s.adc"})
         + message(1, 0, DATA), "no definition of Nope"),
        (topic(1, "/ecdaq/s", "nonsense\n", {"slave": "s"}), "not a field: 'nonsense'"),
        (topic(1, "/ecdaq/s", SCHEMA, {"slave": "s", "adc.channel": "s.adc", "adc.scale": "x"}),
         "could not convert"),
        (record(3, b"\1\0\xff\xff\xff\xff"), "too short"),
        (topic(1, "/ecdaq/s", SCHEMA + "T1[] x\n===\nMSG: test_msgs/T1\nT1 x\n",
               {"slave": "s", "adc.channel": "s.adc"})
         + message(1, 0, b"\0\1\0\0" + bytes(24) + b"\x10" + bytes(40)), "nested definitions"),
    ],
)  # fmt: skip
def test_a_file_that_is_not_as_it_should_be_is_refused_with_the_reason(
    tmp_path: Path, chunk: bytes, reason: str
) -> None:
    path = tmp_path / "x.mcap.part"
    path.write_bytes(unfinished([chunk]))
    with pytest.raises(ecdaq.RecordingError) as raised:
        _ = ecdaq.read(path).table
    assert raised.value.file == str(path)
    assert reason in raised.value.reason


def test_what_cannot_be_opened_is_refused_with_the_reason(tmp_path: Path) -> None:
    (tmp_path / "x.mcap").write_text("hello")
    for where, reason in (
        (tmp_path / "nothing", "No such file"),
        (tmp_path / "x.mcap", "not an MCAP file"),
    ):
        with pytest.raises(ecdaq.RecordingError, match=reason):
            _ = ecdaq.read(where).channels
    (tmp_path / "x.mcap").unlink()
    with pytest.raises(ecdaq.RecordingError, match="no recordings"):
        ecdaq.read(tmp_path)
    with pytest.raises(ValueError, match="s3:// is not supported"):
        ecdaq.read("s3://bucket/x.mcap")
