# SPDX-License-Identifier: MIT
"""Recordings that were changed on the disk: found by check, recovered to what was recorded.

ECDAQ_MUTANTS=N changes N files of each kind (default 30), ECDAQ_MUTANT_SEED=N others.
"""

from __future__ import annotations

import json
import os
import random
from pathlib import Path
from typing import Any

import pytest
from mcap.reader import make_reader
from mcap.records import Channel, Chunk, Schema
from mcap.stream_reader import StreamReader
from mcap_ros2.decoder import DecoderFactory
from recording import Bench

MUTANTS = int(os.environ.get("ECDAQ_MUTANTS", "30"))
SEED = int(os.environ.get("ECDAQ_MUTANT_SEED", "1"))
HEAD = 16 << 10
CHECKED_AT_ONCE = 200

Messages = dict[tuple[str, int, int], tuple[bytes, str, bytes, dict[str, str]]]


def read_all(path: Path) -> Messages:
    """All messages with all that gives them a meaning, by the official reader in both its ways."""
    with path.open("rb") as file:
        for _ in StreamReader(file, validate_crcs=True).records:
            pass
    found: Messages = {}
    with path.open("rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()], validate_crcs=True)
        reader.get_header()
        list(reader.iter_metadata())
        list(reader.iter_attachments())
        for schema, channel, message in reader.iter_messages():
            assert schema is not None
            found[channel.topic, message.sequence, message.log_time] = (
                message.data, schema.name, schema.data, channel.metadata
            )  # fmt: skip
    return found


def decode_some(path: Path) -> list[Any]:
    with path.open("rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        return [m for _, (*_, m) in zip(range(9), reader.iter_decoded_messages(), strict=False)]


def change(data: bytes, end: int, places: int, random_: random.Random) -> bytes:
    """@data with up to @places bytes, or with one sector if more than one, before @end changed.

    A definition has three copies, of which an unfinished file has two.
    """
    changed = bytearray(data)
    if places > 1 and random_.random() < 0.2:
        sector = random_.randrange(end) & ~511
        length = min(512 * random_.choice([1, 8]), end - sector)
        changed[sector : sector + length] = bytes([random_.choice([0, 255])]) * length
    else:
        for _ in range(random_.randint(1, places)):
            changed[random_.randrange(end)] ^= random_.choice([1, 4, 0x10, 0x80, 0xFF])
    return bytes(changed)


def check_all(bench: Bench, paths: list[Path]) -> dict[str, bool]:
    """Whether `ecdaq log check` has nothing to say about each of the files."""
    clean: dict[str, bool] = {}
    for i in range(0, len(paths), CHECKED_AT_ONCE):
        checked = bench.log("check", "--json", *paths[i : i + CHECKED_AT_ONCE])
        for file in json.loads(checked.stdout)["files"]:
            clean[file["file"]] = not file["damaged"] and not file["gaps"]
    return clean


@pytest.fixture
def recorded(bench: Bench) -> Path:
    bench.produce("--cycles", "300", "--events", "3").wait(60)
    bench.record_all("--set", "record.chunk_period=20ms")
    [path] = bench.files()
    return path


@pytest.mark.parametrize("part", ["head", "whole", "unfinished"])
def test_a_changed_recording_is_not_clean_and_is_recovered_to_what_was_recorded(
    bench: Bench, recorded: Path, tmp_path: Path, part: str
) -> None:
    random_ = random.Random(f"{SEED} {part}")
    data = recorded.read_bytes()
    wanted = read_all(recorded)
    end = min(HEAD, len(data) // 2) if part == "head" else len(data)
    places = 1 if part == "unfinished" else 2
    if part == "unfinished":  # as after a power cut: no summary, no data end
        with recorded.open("rb") as file:
            summary = make_reader(file).get_summary()
        assert summary is not None
        last = max(summary.chunk_indexes, key=lambda index: index.chunk_start_offset)
        data = data[: last.chunk_start_offset + last.chunk_length]
        end = len(data)
    paths = []
    for n in range(MUTANTS):
        paths.append(tmp_path / f"{n}.mcap")
        paths[-1].write_bytes(change(data, end, places, random_))
    clean = check_all(bench, paths)
    recovered = 0
    for path in paths:
        if clean[str(path)]:
            assert read_all(path) == wanted, path.name
        copy = tmp_path / f"{path.stem}.copy.mcap"
        if bench.log("recover", path, "--output", copy).returncode != 0:
            continue
        recovered += 1
        found = read_all(copy)
        wrong = [key for key, value in found.items() if wanted.get(key) != value]
        assert not wrong, f"{path.name}: {wrong[:3]}"
        if found:
            assert decode_some(copy)
        again = bench.log("check", "--json", copy)
        assert not json.loads(again.stdout)["files"][0]["damaged"], path.name
    assert recovered >= 0.9 * MUTANTS


def test_a_scale_changed_in_the_head_is_never_exported_as_if_it_were_right(
    bench: Bench, recorded: Path
) -> None:
    export = bench.log("export", recorded).stdout
    data = bytearray(recorded.read_bytes())
    at = data.index(b"adc.scale") + len("adc.scale") + 4
    data[at : at + 20] = data[at : at + 20].replace(b"1", b"9", 1)
    recorded.write_bytes(data)
    checked = bench.log("check", recorded)
    assert checked.returncode == 1
    assert "differs from its copy" in checked.stdout and "NOT CLEAN" in checked.stdout
    wrong = bench.log("export", recorded)
    assert wrong.returncode == 1 and "wrong CRC of the data section" in wrong.stderr
    assert wrong.stdout != export
    copy = recorded.with_name("copy.mcap")
    assert bench.log("recover", recorded, "--output", copy).returncode == 0
    assert bench.log("export", copy).stdout == export


def test_a_foreign_reader_finds_all_definitions_in_the_chunks(recorded: Path) -> None:
    with recorded.open("rb") as file:
        records = list(StreamReader(file, emit_chunks=True, validate_crcs=True).records)
    first = next(n for n, record in enumerate(records) if isinstance(record, Chunk))
    head = [record for record in records[:first] if isinstance(record, Schema | Channel)]
    with recorded.open("rb") as file:
        every = [r for r in StreamReader(file).records if isinstance(r, Schema | Channel)]
    schemas = [r for r in head if isinstance(r, Schema)]
    channels = [r for r in head if isinstance(r, Channel)]
    # In the head, in the first chunk, in the summary.
    assert schemas and channels
    assert every == head + 2 * (schemas + channels)


def test_a_destroyed_first_block_costs_no_sample(bench: Bench, recorded: Path) -> None:
    wanted = read_all(recorded)
    data = recorded.read_bytes()
    recorded.write_bytes(bytes(4096) + data[4096:])
    assert bench.log("check", recorded).returncode == 1
    copy = recorded.with_name("copy.mcap")
    said = bench.log("recover", recorded, "--output", copy)
    assert said.returncode == 0, said.stderr
    assert read_all(copy) == wanted
