# SPDX-License-Identifier: MIT
"""A picture goes on from the ring into the recordings of the session."""

import csv
import io
import itertools
import math
import struct
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from browser import SEEN, Browser
from recording import Bench, wait_until
from web_bench import Web
from web_client import Page

MISSING, BAD = 1, 2
SESSION = "1795700000000000000"
CYCLES = 100_000  # of the session, of which the ring has the newest:
RING_FIRST = 93_000
GAP = range(40_200, 41_700)
CHANNEL = "piccolo1.adc"
Sample = tuple[int, float]


@pytest.fixture
def samples(bench: Bench) -> list[Sample]:
    """A session whose samples are in three files, and the newest of them in the ring."""
    options = ["--session", SESSION, "--bad", "7000"]
    gap = f"{GAP.start}:{len(GAP)}"
    bench.produce(
        "--cycles", str(CYCLES), "--depth", "131072", "--skip", gap, *options
    ).wait(60)  # fmt: skip
    bench.record_all("--set", "record.rotate_size=4MiB")
    (bench.run_dir / "samples").unlink()
    count = str(CYCLES - RING_FIRST)
    bench.produce(
        "--cycles", count, "--first", str(RING_FIRST), "--depth", "8192", "--wait", *options
    )
    text = bench.log("export", bench.folder, "--channels", CHANNEL).stdout
    rows = itertools.islice(csv.reader(io.StringIO(text)), 1, None)
    return [(int(cycle), float(value or "nan")) for cycle, _, value in rows]


@pytest.fixture
def web(bench: Bench, make_web: Callable[..., Web]) -> Web:
    return make_web(record_dir=str(bench.folder))


class Scope(Page):
    """A page that knows its channel."""

    def __init__(self, port: int) -> None:
        super().__init__(port)
        table = self.wait_for("table", lambda m: m["channels"])
        self.index = [channel["name"] for channel in table["channels"]].index(CHANNEL)

    def look(self, **request: Any) -> tuple[dict[str, Any], list[list[float]], bytes]:
        head, values, marks = self.draw(channels=[self.index], **request)
        assert head["op"] == "picture", head
        return head, values, marks


def f32(value: float) -> float:
    return struct.unpack("<f", struct.pack("<f", value))[0]


def columns(samples: list[Sample], first: int, cycles: int, pixels: int) -> list[list[float]]:
    """The good values of each column, by the server's rule."""
    found: list[list[float]] = [[] for _ in range(pixels)]
    for cycle, value in samples:
        # Columns of a second and more are made of whole seconds, but for what the ring has.
        is_coarse = cycles // pixels >= 1000 and cycle < RING_FIRST
        place = cycle // 1000 * 1000 + 500 if is_coarse else cycle
        if first <= place < first + cycles and not math.isnan(value):
            found[(place - first) * pixels // cycles].append(value)
    return found


def check(page: Scope, samples: list[Sample], **request: Any) -> tuple[dict[str, Any], bytes]:
    head, values, marks = page.look(**request)
    pixels = head["pixels"]
    wanted = columns(samples, head["first"], head["cycles"], pixels)
    for k in range(pixels):
        low, high = values[0][k], values[0][pixels + k]
        if wanted[k]:
            assert (low, high) == (f32(min(wanted[k])), f32(max(wanted[k]))), k
        else:
            assert math.isnan(low) and math.isnan(high), k
    good = [value for column in wanted for value in column]
    total = head["sums"][0]
    # But for the column in which the ring begins, if there is one.
    assert total["count"] == pytest.approx(len(good), abs=head["cycles"] / pixels)
    assert (total["min"], total["max"]) == pytest.approx((min(good), max(good)), abs=1e-6)
    assert total["mean"] == pytest.approx(sum(good) / len(good), rel=0.01)
    assert total["rms"] == pytest.approx(math.sqrt(sum(v * v for v in good) / len(good)), rel=0.01)
    return head, marks


def test_columns_of_seconds_are_those_that_were_counted_when_they_were_recorded(
    samples: list[Sample], web: Web
) -> None:
    page = Scope(web.port)
    _, marks = check(page, samples, cycles=CYCLES, pixels=50, end=CYCLES)
    # Of 50 columns of 2 s, the gap is in 20; the sample of each 7000th cycle is bad.
    assert [k for k in range(50) if marks[k] & MISSING] == [20]
    bad = {cycle // 2000 for cycle in range(0, CYCLES, 7000) if cycle not in GAP}
    assert {k for k in range(50) if marks[k] & BAD} == bad


def test_shorter_columns_are_those_of_the_samples_themselves(
    samples: list[Sample], web: Web
) -> None:
    page = Scope(web.port)
    _, marks = check(page, samples, cycles=4000, pixels=1000, end=43_000)
    missing = {k for k in range(1000) if any(39_000 + 4 * k + i in GAP for i in range(4))}
    assert {k for k in range(1000) if marks[k] & MISSING} == missing
    check(page, samples, cycles=100, pixels=1000, end=50_000)
    # Half of it is in the ring.
    check(page, samples, cycles=10_000, pixels=1000, end=98_000)


def test_before_the_session_began_there_is_nothing(samples: list[Sample], web: Web) -> None:
    page = Scope(web.port)
    head, marks = check(page, samples, cycles=3_000_000, pixels=600, end=0)
    assert head["first"] == 0
    assert [k for k in range(600) if marks[k] & MISSING] == [8]


def test_a_picture_that_grows_asks_the_recordings_once_for_a_column(
    samples: list[Sample], web: Web, bench: Bench
) -> None:
    page = Scope(web.port)
    first, _, _ = page.look(cycles=90_000, pixels=30)
    # It ends with a whole column of 3 s.
    assert (first["first"] + first["cycles"]) % 3000 == 0
    for path in bench.files():
        path.unlink()
    second, values, _ = page.look(cycles=90_000, pixels=30)
    assert (second["first"], second["sums"]) == (first["first"], first["sums"])
    assert not any(math.isnan(value) for value in values[0])
    # Another one finds nothing but the ring.
    _, values, _ = page.look(cycles=60_000, pixels=30, end=CYCLES)
    assert [k for k in range(30) if not math.isnan(values[0][k])] == [26, 27, 28, 29]


def test_damaged_recordings_stop_neither_the_server_nor_other_pages(
    samples: list[Sample], web: Web, bench: Bench
) -> None:
    for path in bench.files():
        data = bytearray(path.read_bytes())
        for at in range(5000, len(data), 997):
            data[at] ^= 0x55
        path.write_bytes(data)
    pages = [Scope(web.port) for _ in range(3)]
    for page in pages:
        _, values, _ = page.look(cycles=100_000, pixels=100, end=CYCLES)
        assert not math.isnan(values[0][97])
    assert len(samples) == CYCLES - len(GAP)


def test_pages_that_leave_while_recordings_are_read_are_forgotten(
    samples: list[Sample], web: Web
) -> None:
    for n in range(20):
        page = Scope(web.port)
        page.ask(op="draw", id=1, channels=[0], cycles=50_000 + n, pixels=1000, end=60_000)
        page.sock.close()
    page = Scope(web.port)
    check(page, samples, cycles=CYCLES, pixels=50, end=CYCLES)
    wait_until("no process of it", lambda: not children(web.process.pid))


def children(pid: int) -> str:
    return Path(f"/proc/{pid}/task/{pid}/children").read_text()


def test_the_scope_goes_back_into_the_recordings(
    samples: list[Sample], web: Web, make_browser: Callable[..., Browser]
) -> None:
    browser = make_browser(web, f"#scope?c={CHANNEL}&w=30&end=70000")
    assert browser.wait_for(SEEN) > 0.7
    browser.value("document.querySelector('#scope-back').click()")
    browser.wait_for("location.hash.includes('end=55000')")
    note = "document.querySelector('#scope-note').textContent"
    browser.wait_for(f"{note}.includes('up to cycle 54999')")
    row = "[...document.querySelectorAll('#scope-rows tr:first-child td')]"
    text = browser.value(f"{row}.map((c) => c.textContent).slice(2, 5)")
    assert [float(t) for t in text] == pytest.approx([0.5, 1.5, 1.0], abs=1e-2)
    names = browser.value("[...document.querySelector('#scope-window').options].map((o) => o.text)")
    assert names[-4:] == ["2 h", "6 h", "12 h", "24 h"]
    assert browser.problems() == []
    assert len(samples) == CYCLES - len(GAP)
