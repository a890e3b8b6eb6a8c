# SPDX-License-Identifier: MIT
"""The cycle does not notice how many browsers look at it, nor what they do to ecdaq-web."""

from __future__ import annotations

import json
import os
import random
import socket
import statistics
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from types import TracebackType

import pytest
from segment import BIN, Segment, wait_for

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "cli"))
from web_client import FOXGLOVE, RejectedError, WebSocket

# These measure time, or need a cycle in time.
IDLE = True
WEB = BIN / "ecdaq-web"
CROWDS = (0, 8, 50)
ROUNDS, CYCLES = 3, 3000
LATE = (
    0.01  # part of the cycles that the machine itself may lose, more in one round than in another
)
DRAW = json.dumps({"op": "draw", "id": 1, "channels": [0, 1], "cycles": 2000, "pixels": 800,
                   "end": 0, "edge": "none"})  # fmt: skip


class Client:
    """One connection; what it does each time that it has its turn."""

    def __init__(self, port: int, choice: random.Random) -> None:
        self.port = port
        self.choice = choice
        self.bytes = 0
        self.attempts = 0
        self.web: WebSocket | None = None
        self.sock: socket.socket | None = None

    def act(self) -> None:
        """Connect again if the server has ended it."""
        try:
            if self.sock is None:
                self.attempts += 1
                self.connect()
            else:
                self.go_on(self.sock)
        except BlockingIOError:
            pass
        except (OSError, RejectedError, ConnectionError):
            self.close()

    def connect(self) -> None:
        raise NotImplementedError

    def go_on(self, sock: socket.socket) -> None:
        self.bytes += len(sock.recv(1 << 18))

    def close(self) -> None:
        if self.sock is not None:
            self.sock.close()
        self.sock = self.web = None

    def upgrade(self, protocols: tuple[str, ...], **arguments: int) -> WebSocket:
        self.web = WebSocket(self.port, protocols, **arguments)
        self.sock = self.web.sock
        return self.web


class Looker(Client):
    """A page with its scope open."""

    def connect(self) -> None:
        self.upgrade(("ecdaq.page.v1",)).send(json.dumps({"op": "values", "on": True}))
        assert self.sock is not None
        self.sock.setblocking(False)

    def go_on(self, sock: socket.socket) -> None:
        assert self.web is not None
        self.web.send(DRAW)
        super().go_on(sock)


class Subscriber(Client):
    """A Foxglove viewer of all topics."""

    def connect(self) -> None:
        web = self.upgrade(FOXGLOVE)
        channels: list[int] = []
        while len(channels) < 6:
            message = json.loads(web.recv()[1])
            channels += [c["id"] for c in message.get("channels", [])]
        wanted = [{"id": 100 + i, "channelId": c} for i, c in enumerate(channels)]
        web.ask(op="subscribe", subscriptions=wanted)
        web.sock.setblocking(False)


class Stopped(Subscriber):
    """The same, which never reads."""

    def go_on(self, sock: socket.socket) -> None:
        pass


class Hostile(Client):
    """Requests that never end, no HTTP at all, frames that are none, one after the other."""

    def connect(self) -> None:
        if self.choice.random() < 0.5:
            self.upgrade(("ecdaq.page.v1",))
        else:
            self.sock = socket.create_connection(("127.0.0.1", self.port), timeout=5)
        assert self.sock is not None
        self.sock.setblocking(False)

    def go_on(self, sock: socket.socket) -> None:
        sock.send(self.choice.choice((b"GET / HTTP/1.1\r\nX:", self.choice.randbytes(5000))))
        if self.choice.random() < 0.05:
            self.close()


class Crowd:
    """@count clients: with 8 of them well-behaved ones, with more a fifth each of two bad kinds."""

    def __init__(self, port: int, count: int) -> None:
        choice = random.Random(count)
        bad = [Stopped, Hostile] * (count // 5) if count > 8 else []
        good = [(Looker, Subscriber)[n % 2] for n in range(count - len(bad))]
        self.clients = [kind(port, choice) for kind in (*good, *bad)]
        self.is_over = threading.Event()
        self.thread = threading.Thread(target=self.run)

    def run(self) -> None:
        while not self.is_over.wait(0.04):
            for client in self.clients:
                client.act()

    def __enter__(self) -> Crowd:
        self.thread.start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.is_over.set()
        self.thread.join()
        for client in self.clients:
            client.close()

    def served(self) -> list[int]:
        """Bytes of each of the good ones."""
        return [c.bytes for c in self.clients if isinstance(c, Looker) or type(c) is Subscriber]


class Cycle:
    """What the cycle thread has done so far."""

    def __init__(self, segment: Segment) -> None:
        self.segment = segment
        tasks = Path(f"/proc/{segment.processes['daemon'].pid}/task")
        (self.task,) = (t for t in tasks.iterdir() if "cycle" in (t / "comm").read_text())

    def sleeps(self) -> int:
        """How often it went to sleep itself: for the deadline, and for its frame."""
        text = (self.task / "status").read_text()
        return int(text.split("\nvoluntary_ctxt_switches:")[1].split()[0])

    def figures(self) -> dict[str, int]:
        status = self.segment.status()
        counted = {key: status[key] for key in ("cycles", "frames_lost", "cycles_skipped")}
        return counted | {"sleeps": self.sleeps(), "bad": status["samples_bad_unexplained"]}


@pytest.fixture
def port(tmp_path: Path) -> Iterator[Callable[[Segment], int]]:
    if not WEB.exists():
        pytest.skip("ecdaq-web is not built: it requires libwebsockets-dev and libcjson-dev")
    started: list[subprocess.Popen[bytes]] = []

    def start(segment: Segment) -> int:
        with socket.socket() as sock:
            sock.bind(("127.0.0.1", 0))
            number = sock.getsockname()[1]
        settings = {"web.enable": "on", "web.port": number, "web.clients": 64}
        words = [w for name, value in settings.items() for w in ("--set", f"{name}={value}")]
        with (tmp_path / "web.log").open("wb") as log:
            command = [WEB, "--run-dir", segment.run_dir, *words]
            started.append(subprocess.Popen(command, stderr=log))

        def listens() -> bool:
            with socket.socket() as sock:
                return sock.connect_ex(("127.0.0.1", number)) == 0

        wait_for("a listening ecdaq-web", listens, 30)
        return number

    yield start
    for process in started:
        process.terminate()
        assert process.wait(30) == 0  # whatever was done to it


@pytest.mark.skipif(os.geteuid() != 0, reason="the cycle has priority over browsers as root only")
def test_the_cycle_is_the_same_with_no_client_8_and_50_of_which_some_are_hostile(
    make_segment: Callable[..., Segment], port: Callable[[Segment], int]
) -> None:
    segment = make_segment()
    segment.start_sim()
    segment.start_daemon()
    segment.wait_for_op()
    number = port(segment)
    cycle = Cycle(segment)
    lost: dict[int, list[float]] = {count: [] for count in CROWDS}
    sleeps: dict[int, list[float]] = {count: [] for count in CROWDS}
    print("\nclients  cycles  lost or skipped  sleeps a cycle  MB/s to clients")
    for _ in range(ROUNDS):
        for count in CROWDS:
            with Crowd(number, count) as crowd:
                wait_for("bytes for each client", lambda c=crowd: all(c.served()), 60)
                before, at, sent = cycle.figures(), time.monotonic(), sum(crowd.served())
                segment.wait_for_cycles(CYCLES, 120)
                after = cycle.figures()
                rate = (sum(crowd.served()) - sent) / (time.monotonic() - at) / 1e6
            cycles = after["cycles"] - before["cycles"]
            missed = sum(after[k] - before[k] for k in ("frames_lost", "cycles_skipped"))
            lost[count].append(missed / cycles)
            sleeps[count].append((after["sleeps"] - before["sleeps"]) / cycles)
            print(f"{count:7}  {cycles:6}  {missed:15}  {sleeps[count][-1]:14.3f}  {rate:15.2f}")
            assert after["bad"] == 0
            assert count == 0 or rate > 0.01
    for count in CROWDS[1:]:
        # It sleeps for its deadline and for its frame, whoever looks.
        assert statistics.median(sleeps[count]) == pytest.approx(
            statistics.median(sleeps[0]), rel=0.05
        )
        assert statistics.median(lost[count]) <= statistics.median(lost[0]) + LATE
    assert statistics.median(sleeps[0]) > 1
