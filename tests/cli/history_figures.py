# SPDX-License-Identifier: MIT
"""How long a picture of the past takes: `ecdaq-web` over a day of recordings.

python tests/cli/history_figures.py [HOURS]

Two slaves of three channels at 1 kHz, 24 hours of them, recorded as fast as it goes, an hour a
file; the ring has the newest minute. A client of the page's protocol asks for pictures of 1000
columns of two channels: of all, and of shorter windows at places that it has not seen.
"""

from __future__ import annotations

import random
import shutil
import statistics
import sys
import tempfile
import time
from pathlib import Path

import recording
from web_bench import Web
from web_client import Page

HOUR = 3_600_000  # cycles
MINUTE = HOUR // 60
START_NS = 1_795_700_000_000_000_000
PIXELS = 1000
ROUNDS = 9
WINDOWS = {"1 h": HOUR, "10 min": HOUR // 6, "1 min": MINUTE, "10 s": MINUTE // 6, "1 s": 1000}


def produce(bench: recording.Bench, first: int, cycles: int, *more: str) -> None:
    """A ring of the session with these cycles."""
    (bench.run_dir / "samples").unlink(missing_ok=True)
    words = ["--session", str(START_NS), "--tai", str(START_NS + first * 10**6), "--first"]
    words += [str(first), "--cycles", str(cycles), "--depth", str(1 << 22), *more]
    producer = bench.produce(*words)
    assert producer.stdout is not None
    assert producer.stdout.readline() == f"{START_NS}\n"  # all are in the ring
    if not more:
        producer.wait(60)


def record(bench: recording.Bench, hours: int) -> None:
    for hour in range(hours):
        produce(bench, hour * HOUR, HOUR)
        recorder = bench.record("--once", "--set", "record.budget=64GiB")
        _, output = recorder.communicate(timeout=3600)
        assert recorder.returncode == 0, output
    produce(bench, hours * HOUR - MINUTE, MINUTE, "--wait")


def ask(page: Page, cycles: int, end: int) -> float:
    """Seconds until the picture is there; it has values in each column."""
    started = time.monotonic()
    head, values, _ = page.draw(channels=[1, 4], cycles=cycles, pixels=PIXELS, end=end)
    seconds = time.monotonic() - started
    assert head["op"] == "picture", head
    assert all(value == value for value in values[0]), "a column without a sample"
    return seconds


def main(hours: int) -> None:
    with tempfile.TemporaryDirectory(prefix="ecdaq-history-") as folder:
        run_dir = Path(tempfile.mkdtemp(prefix="ecdaq-history-", dir="/dev/shm"))
        bench = recording.Bench(run_dir, Path(folder))
        try:
            record(bench, hours)
            size = bench.recorded_bytes()
            whole = hours * HOUR
            web = Web(bench, **{"record.dir": folder})
            page = Page(web.port)
            page.wait_for("table", lambda m: m["channels"])
            print(f"{hours} h, {2 * whole / 1e6:.1f} million samples of two slaves,"
                  f" {size / 1e9:.2f} GB in {len(bench.files())} files;"
                  " 1000 columns of two channels")  # fmt: skip
            print(f"{'window':>8}  {'first s':>8}  {'median s':>8}  {'slowest s':>9}  pictures")
            first = ask(page, whole, whole)
            rest = [ask(page, whole - n, whole - n) for n in range(1, ROUNDS)]
            print(f"{hours:>6} h  {first:8.2f}  {statistics.median(rest):8.2f}  {max(rest):9.2f}"
                  f"  {len(rest)}")  # fmt: skip
            places = random.Random(1)
            for name, cycles in WINDOWS.items():
                times = [
                    ask(page, cycles, places.randrange(cycles, whole - MINUTE))
                    for _ in range(ROUNDS)
                ]
                print(f"{name:>8}  {times[0]:8.2f}  {statistics.median(times[1:]):8.2f}"
                      f"  {max(times[1:]):9.2f}  {len(times) - 1}")  # fmt: skip
        finally:
            bench.close()
            shutil.rmtree(run_dir)


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 24)
