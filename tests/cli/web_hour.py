# SPDX-License-Identifier: MIT
"""Whether ecdaq-web and its page grow while they are used: memory, descriptors, heap, nodes.

python tests/cli/web_hour.py [SECONDS]

Samples of two slaves at 1 kHz, without a bus. A page stays open in a browser and goes from view to
view; a viewer stays subscribed to everything; clients of both protocols connect, subscribe, draw
and leave, some of them in the middle of a message; files, figures and log-ins are asked for. After
a warm-up, in which the memory for messages fills, both are looked at: the server when all but these
two have left, the page after a garbage collection.
"""

from __future__ import annotations

import contextlib
import itertools
import sys
import tempfile
import threading
import time
from dataclasses import dataclass
from pathlib import Path

import recording
from browser import Browser, find
from web_bench import Web
from web_client import Page, RejectedError, Viewer, WebSocket, http

WARM_UP_S = 30  # 8 MiB of messages are 25 s
LOOKS = 6
VIEWS = ("state", "bus", "channels", "events", "recordings", "config")
SCOPE = "scope?c=piccolo0.adc,piccolo1.adc&w={}"
WINDOWS = (0.1, 2, 10, 60)
DRAWS = (
    {"cycles": 100, "end": 0},
    {"cycles": 20000, "end": 0},
    {"cycles": 2000, "edge": "rising", "trigger": 0, "level": 1, "before": 500},
    {"channels": [99]},
)
# What may be more at the end than after the warm-up.
SERVER_BYTES = 512 * 1024
HEAP_BYTES = 512 * 1024
NODES = 200
LISTENERS = 20


@dataclass
class Look:
    """At one moment."""

    seconds: float
    clients: int  # that have come and gone
    pictures: int  # that the page has drawn
    descriptors: int
    server_bytes: int
    heap_bytes: int = 0
    nodes: int = 0
    listeners: int = 0

    def line(self) -> str:
        return (
            f"{self.seconds:6.0f} {self.clients:8} {self.pictures:9} {self.descriptors:12}"
            f" {self.server_bytes / 1024:11.0f} {self.heap_bytes / 1024:9.0f} {self.nodes:6}"
            f" {self.listeners:9}"
        )


HEAD = "     s  clients  pictures  descriptors  server KiB  heap KiB  nodes  listeners"


def grown(looks: list[Look]) -> list[str]:
    """What is more in the last look than in the first, by more than it may."""
    first, last = looks[0], looks[-1]
    bounds = {
        "descriptors": 0,
        "server_bytes": SERVER_BYTES,
        "heap_bytes": HEAP_BYTES,
        "nodes": NODES,
        "listeners": LISTENERS,
    }
    return [
        f"{name}: {getattr(first, name)}, then {getattr(last, name)}"
        for name, bound in bounds.items()
        if getattr(last, name) > getattr(first, name) + bound
    ]


def view_topics(web: Web, is_abrupt: bool) -> None:
    """A viewer subscribes to everything, unsubscribes and subscribes again."""
    viewer = Viewer(web.port)
    viewer.wait_for_topics("/ecdaq/piccolo0", "/ecdaq/piccolo1")
    viewer.subscribe(*viewer.channels)
    viewer.ask(op="getParameters", parameterNames=[], id="all")
    for _ in range(50):
        viewer.step()
    if not is_abrupt:
        viewer.ask(op="unsubscribe", subscriptionIds=list(viewer.topic_of))
        viewer.subscribe("/ecdaq/piccolo0")
        viewer.ask(op="nonsense")
        for _ in range(50):
            viewer.step()
    viewer.close()


def use_page(web: Web, is_abrupt: bool) -> None:
    page = Page(web.port)
    page.wait_for("table", lambda m: m["channels"])
    for kind in ("values", "folds", "recordings"):
        page.ask(op=kind, on=True)
    page.ask(op="bus", on=True, slave=1)
    for draw in DRAWS:
        page.draw(**draw)
    if is_abrupt:
        page.ask(op="draw", id=999, cycles=60000, pixels=4096, end=0, channels=[0, 1, 2, 3])
    page.close()


def ask_http(web: Web) -> None:
    for path in ("/", "/main.js", "/nothing", "/config.json", "/recordings/none.mcap"):
        http(web.port, f"GET {path}")
    origin = f"http://127.0.0.1:{web.port}"
    http(web.port, "POST /login", body="x", **{"Origin": origin, "Content-Length": "1"})
    with contextlib.suppress(RejectedError):
        WebSocket(web.port, ("unknown",)).close()


def one_round(web: Web, number: int) -> int:
    """Of so many clients."""
    is_abrupt = number % 2 == 1
    view_topics(web, is_abrupt)
    use_page(web, is_abrupt)
    ask_http(web)
    return 9


class Crowd:
    """Clients that come and go until they are stopped."""

    def __init__(self, web: Web) -> None:
        self.web = web
        self.clients = 0
        self.failure: BaseException | None = None
        self.is_ended = threading.Event()
        self.is_paused = threading.Event()
        self.is_quiet = threading.Event()
        self.thread = threading.Thread(target=self.run)
        self.thread.start()

    def run(self) -> None:
        try:
            for number in itertools.count():
                while self.is_paused.is_set() and not self.is_ended.is_set():
                    self.is_quiet.set()
                    self.is_ended.wait(0.01)
                if self.is_ended.is_set():
                    return
                self.is_quiet.clear()
                self.clients += one_round(self.web, number)
        except BaseException as why:  # told to the other thread
            self.failure = why
        finally:
            self.is_quiet.set()

    def pause(self) -> None:
        self.is_quiet.clear()
        self.is_paused.set()
        self.is_quiet.wait(60)
        if self.failure is not None:
            raise self.failure

    def go_on(self) -> None:
        self.is_paused.clear()

    def end(self) -> None:
        self.is_ended.set()
        self.thread.join(60)


class Subscriber:
    """A viewer that stays."""

    def __init__(self, web: Web) -> None:
        self.viewer = Viewer(web.port)
        self.viewer.wait_for_topics("/ecdaq/piccolo0", "/ecdaq/piccolo1")
        self.viewer.subscribe(*self.viewer.channels)
        self.is_ended = threading.Event()
        self.thread = threading.Thread(target=self.run)
        self.thread.start()

    def run(self) -> None:
        while not self.is_ended.is_set():
            self.viewer.step()

    def end(self) -> None:
        self.is_ended.set()
        self.thread.join(60)
        self.viewer.close()


# Pictures are counted as they are decoded.
COUNT = """
const plain = JSON.parse;
globalThis.pictures = 0;
JSON.parse = (text) => {
  const message = plain(text);
  if (message?.op === 'picture') {
    globalThis.pictures++;
  }
  return message;
};
"""


class OpenPage:
    """The page in a browser, that goes from view to view; without a browser nothing."""

    def __init__(self, web: Web, folder: Path) -> None:
        self.browser = Browser(folder, "about:blank") if find() else None
        self.places = itertools.cycle(VIEWS + tuple(SCOPE.format(w) for w in WINDOWS))
        if self.browser is not None:
            self.browser.tell("Page.addScriptToEvaluateOnNewDocument", source=COUNT)
            self.browser.go(f"http://127.0.0.1:{web.port}/")

    def step(self) -> None:
        if self.browser is None:
            wait_seconds(0.5)
            return
        self.browser.value(f"location.hash = '{next(self.places)}'")
        self.browser.value("new Promise((done) => setTimeout(done, 500))")
        self.browser.seen.clear()  # of the test, not of the page

    def look(self, at: Look) -> None:
        if self.browser is None:
            return
        self.browser.value(f"location.hash = '{SCOPE.format(2)}'")
        self.browser.value("new Promise((done) => setTimeout(done, 500))")
        at.heap_bytes = min(self.heap_bytes() for _ in range(3))
        counters = self.browser.tell("Memory.getDOMCounters")
        at.nodes, at.listeners = counters["nodes"], counters["jsEventListeners"]
        at.pictures = self.browser.value("pictures")

    def heap_bytes(self) -> int:
        assert self.browser is not None
        self.browser.tell("HeapProfiler.collectGarbage")
        return int(self.browser.tell("Runtime.getHeapUsage")["usedSize"])

    def close(self) -> None:
        if self.browser is not None:
            self.browser.close()


def wait_seconds(seconds: float) -> None:
    """What is measured is what a time does, not a condition."""
    time.sleep(seconds)


def private_bytes(web: Web) -> int:
    """Without the rings, which are shared and grow as they are read."""
    for line in Path(f"/proc/{web.process.pid}/status").read_text().splitlines():
        if line.startswith("RssAnon:"):
            return int(line.split()[1]) * 1024
    raise AssertionError("no RssAnon")


def descriptors(web: Web) -> int:
    return len(list(Path(f"/proc/{web.process.pid}/fd").iterdir()))


def settled_descriptors(web: Web, wanted: int | None) -> int:
    """When those of clients that have left are closed: as many as @wanted, or no less for 1 s."""
    end = time.monotonic() + 20
    fewest, since = descriptors(web), time.monotonic()
    while time.monotonic() < end:
        wait_seconds(0.05)
        count = descriptors(web)
        if count < fewest:
            fewest, since = count, time.monotonic()
        if (wanted is not None and count <= wanted) or (
            wanted is None and time.monotonic() - since >= 1
        ):
            return count
    return descriptors(web)


def hold_open(web: Web, folder: Path, seconds: float, warm_up: float = WARM_UP_S) -> list[Look]:
    """Looks at both, from the end of the warm-up on."""
    page = OpenPage(web, folder)
    subscriber = Subscriber(web)
    crowd = Crowd(web)
    looks: list[Look] = []
    started = time.monotonic()
    try:
        for number in range(LOOKS):
            while time.monotonic() < started + warm_up + number * seconds / (LOOKS - 1):
                page.step()
            crowd.pause()
            count = settled_descriptors(web, looks[0].descriptors if looks else None)
            at = Look(time.monotonic() - started, crowd.clients, 0, count, private_bytes(web))
            page.look(at)
            looks.append(at)
            crowd.go_on()
    finally:
        crowd.end()
        subscriber.end()
        page.close()
    return looks


def main(seconds: float) -> int:
    with tempfile.TemporaryDirectory(prefix="ecdaq-hour-") as name:
        folder = Path(name)
        run_dir = Path(tempfile.mkdtemp(prefix="ecdaq-hour-", dir="/dev/shm"))
        (folder / "recordings").mkdir()
        bench = recording.Bench(run_dir, folder / "recordings")
        try:
            bench.produce("--cycles", "1000000000", "--pace", "--events", "600")
            web = Web(bench, **{"record.dir": str(folder / "recordings")})
            looks = hold_open(web, folder, seconds)
        finally:
            bench.close()
            for file in run_dir.iterdir():
                file.unlink()
            run_dir.rmdir()
    print(f"{seconds:g} s after a warm-up of {WARM_UP_S} s; server: private memory")
    print(HEAD)
    for look in looks:
        print(look.line())
    more = grown(looks)
    print("nothing has grown" if not more else "grown: " + "; ".join(more))
    return 0 if not more else 1


if __name__ == "__main__":
    sys.exit(main(float(sys.argv[1]) if len(sys.argv) > 1 else 3600))
