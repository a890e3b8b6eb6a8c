# SPDX-License-Identifier: MIT
"""`ecdaq log cut`: some cycles of a session as a recording of their own."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from ecdaq import ECDAQ, ROOT
from mcap.reader import make_reader
from recording import Bench, wait_until

CYCLES = 40_000
GAP = range(20_200, 20_300)
WANTED = (9_900, 30_100)
AROUND_THE_GAP = (20_100, 20_300)


def is_near(event: tuple[int, int, bytes], first: int) -> bool:
    """The made ones are all in the first second of the recording, also those of the last one."""
    return first < 2000 or event[0] < 2


KIT = """
import sys
import ecdaq
recording = ecdaq.read(sys.argv[1])
data = recording["piccolo0.adc"]
print(recording.newest().channels is not None, data.cycle[0], data.cycle[-1], len(data.cycle))
"""


@pytest.fixture
def session(bench: Bench) -> Bench:
    """Several files with a gap, and events in them."""
    bench.produce(
        "--cycles", str(CYCLES), "--depth", "65536", "--skip", f"{GAP.start}:{len(GAP)}",
        "--events", "350",
    ).wait(60)  # fmt: skip
    bench.record_all("--set", "record.rotate_size=2MiB")
    assert len(bench.files()) >= 2
    return bench


def cut(bench: Bench, output: Path, first: int, last: int, *words: str) -> Path:
    done = bench.log(
        "cut", "--dir", bench.folder, "--from", str(first), "--to", str(last),
        "--output", output, *words,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    return output


def messages(paths: list[Path], topic: str) -> list[tuple[int, int, bytes]]:
    found = []
    for path in paths:
        with path.open("rb") as file:
            for _, _, raw in make_reader(file, validate_crcs=True).iter_messages(topics=[topic]):
                found.append((raw.sequence, raw.log_time, raw.data))
    return found


def number(data: bytes, at: int) -> int:
    return int.from_bytes(data[4 + at : 12 + at], "little")


def metadata(path: Path) -> dict[str, dict[str, str]]:
    with path.open("rb") as file:
        return {m.name: m.metadata for m in make_reader(file).iter_metadata()}


def attachments(path: Path) -> list[Any]:
    with path.open("rb") as file:
        return list(make_reader(file).iter_attachments())


def test_a_cut_has_the_messages_of_its_cycles_and_no_others(session: Bench, tmp_path: Path) -> None:
    first, last = WANTED
    whole = session.files()
    output = cut(session, tmp_path / "part.mcap", first, last)
    kept = [m for m in messages(whole, "/ecdaq/cycle") if first <= number(m[2], 0) <= last]
    assert len(kept) == last - first + 1 - len(GAP)
    assert messages([output], "/ecdaq/cycle") == kept
    for slave in ("/ecdaq/piccolo0", "/ecdaq/piccolo1"):
        sent = [m for m in messages(whole, slave) if first <= m[0] <= last]
        assert messages([output], slave) == sent
        assert len(sent) == len(kept)
    assert len(messages([output], "/ecdaq/timemap")) >= (last - first) // 1000 - 1


def test_events_are_those_of_the_cycles_also_where_they_were_recorded_later(
    session: Bench, tmp_path: Path
) -> None:
    whole = messages(session.files(), "/ecdaq/event")
    # The recorder was behind: events of its first samples are after 2048 of them.
    for first, last in [(0, CYCLES), (500, 1500), AROUND_THE_GAP]:
        events = [m for m in whole if first <= number(m[2], 24) <= last and is_near(m, first)]
        output = cut(session, tmp_path / f"{first}.mcap", first, last)
        assert messages([output], "/ecdaq/event") == events
        assert len(events) == {0: len(whole), 500: 11}.get(first, 1)


def test_a_cut_says_what_it_is(session: Bench, tmp_path: Path) -> None:
    first, last = WANTED
    whole = session.files()
    output = cut(session, tmp_path / "part.mcap", first, last)
    notes = metadata(output)
    origin = metadata(whole[0])
    for name in ("ecdaq.config", "ecdaq.channels"):
        assert notes[name] == origin[name]
    number_of = origin["ecdaq.session"]["session"]
    assert notes["ecdaq.session"]["session"] == number_of
    assert notes["ecdaq.session"]["cycles_before"] == "0"
    assert notes["ecdaq.session"]["next_cycle"] == str(first)
    assert notes["ecdaq.end"]["first_cycle"] == str(first)
    assert notes["ecdaq.end"]["last_cycle"] == str(last)
    assert notes["ecdaq.end"]["cycles"] == str(last - first + 1 - len(GAP))
    note = notes["ecdaq.cut"]
    assert (note["session"], note["from"], note["to"]) == (number_of, str(first), str(last))
    assert set(note["names"].split()) <= {path.name for path in whole}
    assert note["files"] == str(len(note["names"].split()))
    assert int(note["files"]) >= 2
    # Seconds that the cut goes through are not those that were counted.
    assert [a.name for a in attachments(output)] == ["ecdaq.idl"]


def test_a_cut_is_a_recording_for_our_readers(session: Bench, tmp_path: Path) -> None:
    first, last = GAP.stop, WANTED[1]
    output = cut(session, tmp_path / "part.mcap", first, last)
    done = session.log("check", output, "--json")
    assert done.returncode == 0, done.stdout
    assert json.loads(done.stdout)["cycles"] == last - first + 1
    words = ["--channels", "piccolo1.adc"]
    table = session.log("export", output, *words).stdout
    some = session.log(
        "export", session.folder, *words, "--from", str(first), "--to", str(last)
    ).stdout
    assert table == some
    kit = ROOT / "app" / "services" / "publish" / "python"
    read = subprocess.run(
        [sys.executable, "-c", KIT, str(output)],
        capture_output=True, text=True, check=False, env={"PYTHONPATH": str(kit)},
    )  # fmt: skip
    assert read.stdout.split() == ["True", str(first), str(last), str(last - first + 1)], (
        read.stderr
    )
    # As a file among others: what was not counted is counted from the samples.
    folder = tmp_path / "folder"
    folder.mkdir()
    output.rename(folder / session.files()[0].name)
    seconds = session.log("envelope", "--dir", folder, "--rows", "3", *words).stdout
    whole_seconds = last // 1000 * 1000 - first  # the middle of the last one is behind the cut
    assert sum(int(line.split(",")[1]) for line in seconds.splitlines()[1:]) == whole_seconds


def test_a_cut_goes_to_a_pipe(session: Bench, tmp_path: Path) -> None:
    output = cut(session, tmp_path / "part.mcap", *WANTED)
    words = ["--from", str(WANTED[0]), "--to", str(WANTED[1])]
    piped = subprocess.run(
        [ECDAQ, "log", "cut", "--dir", session.folder, *words], capture_output=True, check=True
    )
    assert piped.stdout == output.read_bytes()


def test_a_recording_that_goes_on_can_be_cut(bench: Bench, tmp_path: Path) -> None:
    bench.produce("--cycles", "1000000", "--pace")
    bench.record("--set", "record.sync_period=0.1s")

    def is_there() -> bool:
        return bench.log("export", bench.folder, "--from", "800", "--to", "800").returncode == 0

    wait_until("cycles in the file", is_there)
    assert [path.suffix for path in bench.folder.glob("ecdaq-*")] == [".part"]
    output = cut(bench, tmp_path / "part.mcap", 200, 700)
    done = bench.log("check", output, "--json")
    assert (done.returncode, json.loads(done.stdout)["cycles"]) == (0, 501)


def test_the_session_is_the_newest_one_or_that_which_is_named(
    session: Bench, tmp_path: Path
) -> None:
    older = metadata(session.files()[0])["ecdaq.session"]["session"]
    session.produce("--cycles", "300", "--first", "5000").wait(60)
    session.record_all()
    newest = cut(session, tmp_path / "newest.mcap", 0, 5099)
    assert metadata(newest)["ecdaq.end"]["cycles"] == "100"
    named = cut(session, tmp_path / "named.mcap", 0, 5099, "--session", older)
    assert metadata(named)["ecdaq.end"]["cycles"] == "5100"


def test_what_cannot_be_cut_leaves_no_file(session: Bench, tmp_path: Path) -> None:
    output = tmp_path / "part.mcap"
    for words, why in [
        (["--from", "90000"], "there is no such cycle"),
        (["--from", str(GAP.start + 1), "--to", str(GAP.stop - 1)], "there is no such cycle"),
        (["--from", "9", "--to", "8"], "--from: is after --to"),
        (["--session", "1"], "there is no such cycle"),
        (["--from", "-1"], "--from"),
    ]:
        done = session.log("cut", "--dir", session.folder, *words, "--output", output)
        assert done.returncode != 0
        assert why in done.stderr
        assert len(done.stderr.splitlines()) == 1
        assert not output.exists()
    output.write_text("mine")
    done = session.log("cut", "--dir", session.folder, "--output", output)
    assert (done.returncode, output.read_text()) == (1, "mine")
    assert re.search(r"part\.mcap: File exists", done.stderr)
    full = session.log("cut", "--dir", session.folder, "--output", Path("/dev/full"))
    assert full.returncode == 1


def test_damage_is_told_and_the_rest_is_cut(session: Bench, tmp_path: Path) -> None:
    path = session.files()[0]
    data = bytearray(path.read_bytes())
    data[len(data) // 2] ^= 0x40
    path.write_bytes(data)
    output = tmp_path / "part.mcap"
    done = session.log("cut", "--dir", session.folder, "--output", output)
    assert done.returncode == 1
    assert path.name in done.stderr
    kept = int(metadata(output)["ecdaq.end"]["cycles"])
    assert 0 < kept < CYCLES - len(GAP)
    check = json.loads(session.log("check", output, "--json").stdout)
    assert (check["damaged_files"], check["cycles"]) == (0, kept)
