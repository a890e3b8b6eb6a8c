# SPDX-License-Identifier: MIT
"""ecdaq-stream on a bus: each cycle of each slave is in the stream once, whatever is killed."""

from __future__ import annotations

import random
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from segment import BIN, Segment, recorded, wait_for

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "cli"))
from stream_bench import SERVER, Server

STREAM = BIN / "ecdaq-stream"
SECONDS = 120
KILLS = 3


@pytest.fixture
def server(tmp_path: Path) -> Iterator[Server]:
    if not STREAM.exists():
        pytest.skip("ecdaq-stream is not built: it requires libnats-dev and libcjson-dev")
    if SERVER is None:
        pytest.skip("no nats-server here")
    made = Server(tmp_path / "nats")
    made.create_stream()
    yield made
    made.kill()


@pytest.fixture
def start(server: Server) -> Iterator[Callable[[Segment], subprocess.Popen[bytes]]]:
    started: list[subprocess.Popen[bytes]] = []

    def make(segment: Segment) -> subprocess.Popen[bytes]:
        words = {
            "stream.enable": "on",
            "stream.servers": f"nats://127.0.0.1:{server.port}",
            "stream.appliance": "rig1",
            "record.dir": str(segment.record_dir),
        }
        command = [str(STREAM), "--run-dir", str(segment.run_dir)]
        for name, value in words.items():
            command += ["--set", f"{name}={value}"]
        started.append(subprocess.Popen(command, stderr=subprocess.DEVNULL))
        return started[-1]

    yield make
    for process in started:
        process.kill()
        process.wait(timeout=SECONDS)


def test_each_cycle_of_a_bus_is_stored_once_while_server_and_streamer_are_killed(
    make_segment: Callable[..., Segment],
    server: Server,
    start: Callable[[Segment], subprocess.Popen[bytes]],
) -> None:
    chance = random.Random(1)
    segment = make_segment()
    segment.start_all()
    stream = start(segment)
    for _ in range(KILLS):
        goal = server.state().messages + chance.randrange(5, 40)
        wait_for("blocks", lambda goal=goal: server.state().messages >= goal, SECONDS)
        server.kill()
        stream.kill()
        stream.wait(timeout=SECONDS)
        stream = start(segment)
        segment.wait_for_cycles(chance.randrange(200, 3000), SECONDS)
        server.start()
    assert segment.stop("daemon") == 0
    assert segment.stop("recorder") == 0
    cycles = [m.cycle for m in recorded(segment.record_dir, "/ecdaq/cycle")]
    [session] = {m.number("Session") for m in server.messages() if "block" in m.subject}

    def is_complete() -> bool:
        slaves = {m.subject.split(".")[2] for m in server.messages() if "block" in m.subject}
        return all(server.last_cycle(session, slave) == cycles[-1] + 1 for slave in slaves)

    wait_for("the last cycle", is_complete, SECONDS)
    found: dict[str, list[int]] = {}
    for message in server.messages():
        if message.subject.endswith(".block"):
            found.setdefault(message.subject, []).extend(message.cycles())
    assert len(found) == 2
    for subject, own in found.items():
        print(f"{subject}: {len(own)} of {len(cycles)} cycles, {len(own) - len(set(own))} doubled")
        assert own == cycles
