# SPDX-License-Identifier: MIT
"""`ecdaq log envelope` says of each part of a session what all of its samples say."""

import csv
import io
import json
import math
from collections.abc import Set
from pathlib import Path

import pytest
from mcap.reader import make_reader
from recording import PRODUCER, Bench

CYCLES = 90_000
LAST = CYCLES + 1500  # of which 1500 have no sample
BLOCK = 1000


class Part:
    def __init__(self) -> None:
        self.samples = 0
        self.values: list[float] = []


def exported(bench: Bench, channel: str) -> list[tuple[int, float | None]]:
    text = bench.log("export", bench.folder, "--channels", channel).stdout
    (_, _, column), *rows = csv.reader(io.StringIO(text))
    assert column.split(" [")[0] == channel
    return [(int(cycle), float(value) if value else None) for cycle, _, value in rows]


def envelope(bench: Bench, *words: str, damage: Set[str] = frozenset()) -> list[dict[str, str]]:
    done = bench.log("envelope", "--dir", bench.folder, *words)
    # Damage is reported, and what is undamaged is there, as with `export`.
    reasons = {line.rsplit(": ", 1)[1] for line in done.stderr.splitlines()}
    assert reasons <= damage
    assert done.returncode == (1 if reasons else 0)
    return list(csv.DictReader(io.StringIO(done.stdout)))


def check(
    bench: Bench,
    samples: list[tuple[int, float | None]],
    first: int,
    last: int,
    rows: int,
    damage: Set[str] = frozenset(),
) -> None:
    """The command's table beside the same made of single samples."""
    span = last - first + 1
    rows = min(rows, span)
    parts: dict[int, Part] = {}
    for cycle, value in samples:
        # Parts of a second and more are made of whole seconds, placed by their middle.
        place = cycle // BLOCK * BLOCK + BLOCK // 2 if span // rows >= BLOCK else cycle
        if first <= place <= last:
            part = parts.setdefault((place - first) * rows // span, Part())
            part.samples += 1
            if value is not None:
                part.values.append(value)
    name = "piccolo1.adc"
    words = ["--channels", name, "--from", str(first), "--to", str(last), "--rows", str(rows)]
    table = envelope(bench, *words, damage=damage)
    assert [int(row["samples"]) for row in table] == [parts[k].samples for k in sorted(parts)]
    for row, k in zip(table, sorted(parts), strict=True):
        values = parts[k].values
        assert (int(row["cycle"]) - first) * rows // span == k
        assert int(row[f"{name} good"]) == len(values)
        if not values:
            assert row[f"{name} min [V]"] == ""
            continue
        found = [float(row[f"{name} {what} [V]"]) for what in ("min", "max", "mean", "rms")]
        rms = math.sqrt(sum(value * value for value in values) / len(values))
        assert found == pytest.approx(
            [min(values), max(values), sum(values) / len(values), rms], rel=1e-6
        )


@pytest.fixture
def session(bench: Bench) -> Bench:
    """Several files, with a gap and bad samples."""
    bench.produce(
        "--cycles", str(LAST), "--depth", "131072", "--skip", "40200:1500", "--bad", "7"
    ).wait(60)
    bench.record_all("--set", "record.rotate_size=4MiB")
    assert len(bench.files()) >= 2
    return bench


@pytest.mark.parametrize("rows", [3, 10, 90])
def test_parts_of_seconds_are_of_the_seconds_that_were_counted(session: Bench, rows: int) -> None:
    samples = exported(session, "piccolo1.adc")
    check(session, samples, 0, samples[-1][0], rows)
    check(session, samples, 12_345, 77_777, rows if rows < 60 else 60)


@pytest.mark.parametrize(("first", "last"), [(0, 999), (39_900, 42_100), (30_001, 80_002)])
def test_shorter_parts_are_of_the_samples_themselves(session: Bench, first: int, last: int) -> None:
    check(session, exported(session, "piccolo1.adc"), first, last, 1000)


def test_without_a_range_it_is_the_newest_session(session: Bench) -> None:
    session.produce("--cycles", "300", "--first", "5000").wait(60)
    session.record_all()
    table = envelope(session, "--rows", "3")
    assert [(row["cycle"], row["samples"]) for row in table] == [
        ("5000", "100"),
        ("5100", "100"),
        ("5200", "100"),
    ]
    assert list(table[0])[2:7] == [
        "piccolo0.adc good",
        "piccolo0.adc min [V]",
        "piccolo0.adc max [V]",
        "piccolo0.adc mean [V]",
        "piccolo0.adc rms [V]",
    ]


def cut(path: Path, share: float) -> None:
    part = path.with_suffix(".part")
    path.rename(part)
    with part.open("r+b") as file:
        file.truncate(int(part.stat().st_size * share))


def test_of_a_file_without_its_end_samples_take_the_place_of_seconds(session: Bench) -> None:
    cut(session.files()[-1], 0.6)
    samples = exported(session, "piccolo1.adc")
    assert 50_000 < len(samples) < CYCLES
    damage = {"file ends within a record"}
    check(session, samples, 0, samples[-1][0], 9, damage)
    check(session, samples, 50_000, 60_000, 500, damage)
    table = envelope(session, "--rows", "1", damage=damage)
    assert int(table[0]["samples"]) == len(samples)


def test_seconds_that_are_damaged_are_made_of_samples_again(session: Bench) -> None:
    for path in session.files():
        data = bytearray(path.read_bytes())
        at = data.find(b"ecdaq.envelope")
        while at > 0:
            data[at + 200] ^= 0x10
            at = data.find(b"ecdaq.envelope", at + 1)
        path.write_bytes(data)
    samples = exported(session, "piccolo1.adc")
    assert len(samples) == CYCLES
    check(session, samples, 0, LAST - 1, 9, {"record is malformed"})


def test_the_seconds_are_attachments_that_other_readers_skip(session: Bench) -> None:
    for path in session.files():
        with path.open("rb") as file:
            attachments = list(make_reader(file, validate_crcs=True).iter_attachments())
        found = [a for a in attachments if a.name == "ecdaq.envelope"]
        assert found and {a.media_type for a in found} == {"application/x-ecdaq-envelope"}
        assert len(b"".join(a.data for a in found)) < 0.01 * path.stat().st_size
    checked = json.loads(session.log("check", session.folder, "--json").stdout)
    assert [file["damaged"] for file in checked["files"]] == [0] * len(session.files())


@pytest.mark.parametrize(
    ("words", "why"),
    [
        (["--rows", "0"], "--rows: is not 1 to 65536"),
        (["--rows", "65537"], "--rows: is not 1 to 65536"),
        (["--from", "9", "--to", "8"], "--from: is after --to"),
        (["--channels", "piccolo9.adc"], "has no channel piccolo9.adc"),
        (["--session", "77"], "there is no such cycle"),
        (["--from", "200000", "--to", "200001"], "there is no such cycle"),
        (["--to", str(1 << 48)], "more than 2^48 cycles"),
    ],
)
def test_what_is_not_there_is_one_line(session: Bench, words: list[str], why: str) -> None:
    done = session.log("envelope", "--dir", session.folder, *words)
    assert done.returncode in (1, 2) and done.stdout == ""
    assert done.stderr.count("\n") <= len(session.files()) and why in done.stderr


def test_more_rows_and_channels_than_the_memory_is_meant_for_are_one_line(bench: Bench) -> None:
    producer = PRODUCER.with_name(f"{PRODUCER.name}_512")
    bench.start(producer, bench.run_dir, "--cycles", "6000", "--depth", "8192").wait(60)
    bench.record_all("--set", "record.rotate_size=16MiB")
    assert len(bench.files()) > 1
    done = bench.log("envelope", "--dir", bench.folder, "--rows", "6000")
    assert done.returncode == 1 and done.stderr.count("\n") == 1
    assert "use --channels, or less --rows" in done.stderr
    assert len(envelope(bench, "--rows", "6000", "--channels", "piccolo511.adc")) == 6000
