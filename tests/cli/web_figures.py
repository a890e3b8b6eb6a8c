# SPDX-License-Identifier: MIT
"""What a client of ecdaq-web costs, and how old a sample is when it is drawn.

python tests/cli/web_figures.py [SECONDS [HISTORY_MINUTES]]

Samples of two slaves with three channels each, of 64 with 16 and of 512 with three, at 1 kHz,
without a bus; clients of the protocol that ask as the page does; for the age of a sample the page
itself in a browser. Of the first two also an hour of history: recorded as fast as it goes, then
continued live by the same session, with a recorder; the scope has the whole hour open. Processor
time is that of ecdaq-web and of the processes that it starts to read recordings.
"""

from __future__ import annotations

import json
import shutil
import statistics
import sys
import tempfile
import threading
import time
from collections.abc import Callable
from pathlib import Path
from subprocess import Popen
from typing import Any

import recording
from browser import Browser, find
from web_bench import Web
from web_client import Page

REDRAW_S = 0.04
SAMPLE_TIME = 2  # piccolo0.sample_time: DC time of the edge
DC_START_NS = 800_000_000 * 10**9  # of the producer
DRAW: dict[str, Any] = {"channels": [0, 3], "cycles": 2000, "pixels": 900, "end": 0}
START_NS = 1_795_700_000_000_000_000  # of a session with history
CHUNK = 300_000  # cycles that are in a ring at a time while the history is made
RISING = {"edge": "rising", "trigger": 0, "level": 1, "before": 500}


def wait_seconds(seconds: float) -> None:
    """What is measured is a time, not a condition."""
    time.sleep(seconds)


class Client(Page):
    """One that counts what it receives."""

    bytes = 0
    pictures = 0

    def frame(self) -> tuple[int, bytes]:
        opcode, payload = super().frame()
        self.bytes += len(payload)
        return opcode, payload

    def run(self, seconds: float, request: dict[str, Any]) -> None:
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            if request["op"] != "draw":
                self.step()
                continue
            started = time.monotonic()
            self.draw(**{k: v for k, v in request.items() if k != "op"})
            self.pictures += 1
            wait_seconds(max(REDRAW_S - (time.monotonic() - started), 0))


VIEWS: dict[str, dict[str, Any]] = {
    "State": {"op": "none"},
    "Channels": {"op": "values", "on": True},
    "Events": {"op": "folds", "on": True},
    "Scope, 2 s": {"op": "draw"} | DRAW,
    "Scope, 2 s, trigger": {"op": "draw"} | DRAW | RISING,
    "Scope, 60 s": {"op": "draw"} | DRAW | {"cycles": 60000},
}


def measure(web: Web, count: int, seconds: float, request: dict[str, Any]) -> list[float]:
    """Of one client: bytes a second, share of a processor in percent, pictures a second."""
    clients = [Client(web.port) for _ in range(count)]
    for client in clients:
        client.wait_for("table", lambda m: m["channels"])
        client.ask(**request)
        client.bytes = 0
    threads = [threading.Thread(target=c.run, args=(seconds, request)) for c in clients]
    started, cpu = time.monotonic(), web.cpu_seconds()
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    took = time.monotonic() - started
    cpu = web.cpu_seconds() - cpu
    for client in clients:
        client.close()
    return [
        sum(c.bytes for c in clients) / took / count,
        100 * cpu / took / count,
        sum(c.pictures for c in clients) / took / count,
    ]


# For each picture the time of the frame that shows it, and the DC time of its newest edge.
WATCH = """
const plain = JSON.parse;
globalThis.ages = [];
JSON.parse = (text) => {
  const message = plain(text);
  if (message?.op === 'picture') {
    requestAnimationFrame(() =>
      ages.push([performance.timeOrigin + performance.now(), message.sums[0].max]));
  }
  return message;
};
"""


def ages_ms(web: Web, folder: Path, seconds: float) -> list[float]:
    """From the wake of the cycle of the newest sample to the frame of the browser that shows it."""
    page = Page(web.port)
    while not page.events:
        page.step()
    start_ms = page.events[0]["ms"]  # when the producer began; its first wake is a period later
    page.close()
    browser = Browser(folder, "about:blank")
    try:
        browser.tell("Page.addScriptToEvaluateOnNewDocument", source=WATCH)
        browser.go(f"http://127.0.0.1:{web.port}/#scope?c=piccolo0.sample_time&w=2")
        browser.wait_for("globalThis.ages?.length > 10")
        browser.value("void (ages.length = 0)")
        wait_seconds(seconds)
        found = json.loads(browser.value("JSON.stringify(ages)"))
    finally:
        browser.close()
    return [
        drawn_ms - (start_ms + (edge_ns - DC_START_NS) / 1e6 + 1) for drawn_ms, edge_ns in found
    ]


def produce(bench: recording.Bench, program: Path, first: int, *words: str) -> Popen[str]:
    """A ring of the session, from this cycle on."""
    (bench.run_dir / "samples").unlink(missing_ok=True)
    tai = START_NS + first * 10**6
    return bench.start(
        program, bench.run_dir, "--session", str(START_NS), "--tai", str(tai),
        "--first", str(first), *words,
    )  # fmt: skip


def record(bench: recording.Bench, program: Path, cycles: int) -> None:
    """So many cycles, as fast as it goes."""
    for first in range(0, cycles, CHUNK):
        count = min(CHUNK, cycles - first)
        producer = produce(bench, program, first, "--cycles", str(count), "--depth", str(1 << 19))
        assert producer.wait(600) == 0
        recorder = bench.record("--once", "--set", "record.budget=64GiB")
        _, output = recorder.communicate(timeout=3600)
        assert recorder.returncode == 0, output


def on_history(program: Path, cycles: int, act: Callable[[Web], None]) -> None:
    with tempfile.TemporaryDirectory(prefix="ecdaq-web-") as folder:
        run_dir = Path(tempfile.mkdtemp(prefix="ecdaq-web-", dir="/dev/shm"))
        bench = recording.Bench(run_dir, Path(folder))
        try:
            record(bench, program, cycles)
            size = bench.recorded_bytes()
            print(f"  {cycles / 60000:g} min of history: {size / 1e9:.2f} GB", flush=True)
            produce(bench, program, cycles, "--cycles", "100000000", "--pace", "--events", "1")
            recording.wait_until("a ring", (run_dir / "samples").exists)
            bench.record("--set", "record.budget=64GiB")
            act(Web(bench, **{"web.clients": "64", "record.dir": folder}))
        finally:
            bench.close()
            shutil.rmtree(run_dir)


def on_bench(program: Path, act: Callable[[Web, Path], None]) -> None:
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "run").mkdir()
        (folder / "recordings").mkdir()
        bench = recording.Bench(folder / "run", folder / "recordings")
        try:
            producer = bench.start(
                program, bench.run_dir, "--cycles", "100000000", "--pace", "--events", "1"
            )
            web = Web(bench, **{"web.clients": "64"})
            act(web, folder)
            producer.terminate()
        finally:
            bench.close()


def print_costs(web: Web, seconds: float) -> None:
    first = Client(web.port)
    while first.draw(**DRAW | {"cycles": 60000, "end": 0})[0].get("first", 0) == 0:
        wait_seconds(0.5)  # until there is a minute of samples
    first.close()
    print_views(web, seconds, VIEWS)


def print_history(web: Web, seconds: float, cycles: int) -> None:
    """With the whole of it in the scope, up to the newest sample."""
    client = Client(web.port)
    client.wait_for("table", lambda m: m["channels"])
    started = time.monotonic()
    head, values, _ = client.draw(**DRAW | {"cycles": cycles})
    took = time.monotonic() - started
    assert head["op"] == "picture", head
    empty = sum(value != value for value in values[0][: head["pixels"]])
    print(f"  first picture after {took:.2f} s, {empty} of {head['pixels']} columns empty")
    client.close()
    view = {f"Scope, {cycles / 60000:g} min": {"op": "draw"} | DRAW | {"cycles": cycles}}
    print_views(web, seconds, view)


def print_views(web: Web, seconds: float, views: dict[str, dict[str, Any]]) -> None:
    nobody, cpu = time.monotonic(), web.cpu_seconds()
    wait_seconds(seconds)
    idle = 100 * (web.cpu_seconds() - cpu) / (time.monotonic() - nobody)
    print(f"  {'no client':30} {'':>12} {idle:10.2f} %")
    for view, request in views.items():
        for count in (1, 8):
            sent, share, pictures = measure(web, count, seconds, request)
            share -= idle / count
            drawn = f"{pictures:8.1f} pictures/s" if pictures else ""
            print(
                f"  {view + f', {count} clients':30} {sent / 1000:9.1f} kB/s {share:9.2f} % {drawn}"
            )


def print_ages(web: Web, folder: Path, seconds: float) -> None:
    ages = ages_ms(web, folder, seconds)
    cuts = statistics.quantiles(ages, n=100)
    print(f"  {len(ages)} pictures: p50 {cuts[49]:.1f} ms, p99 {cuts[98]:.1f} ms")


def main(arguments: list[str]) -> None:
    seconds = float(arguments[0]) if arguments else 5
    history = int(float(arguments[1]) * 60000) if len(arguments) > 1 else 3_600_000
    benches = {
        "2 slaves x 3 channels": (recording.PRODUCER, history),
        "64 slaves x 16 channels": (Path(f"{recording.PRODUCER}_64x16"), history),
        "512 slaves x 3 channels": (Path(f"{recording.PRODUCER}_512"), 0),
    }
    for what, (program, cycles) in benches.items():
        print(f"{what}, 1 kHz; of one client, {seconds:g} s each:", flush=True)
        on_bench(program, lambda web, _: print_costs(web, seconds))
        if cycles > 0:
            on_history(program, cycles, lambda web, n=cycles: print_history(web, seconds, n))
    print("from the wake of a cycle to the browser's frame that shows its sample, window of 2 s:")
    if find() is None:
        print("  no chromium-headless-shell here")
    else:
        on_bench(recording.PRODUCER, lambda web, folder: print_ages(web, folder, 4 * seconds))


if __name__ == "__main__":
    main(sys.argv[1:])
