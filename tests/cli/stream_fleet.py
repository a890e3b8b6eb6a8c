# SPDX-License-Identifier: MIT
"""What the live streams of many appliances cost in one JetStream, and whether all of it arrives.

python tests/cli/stream_fleet.py [APPLIANCES [SECONDS]]

Each appliance is a ring of two slaves with three channels, written at 1 kHz, and an ecdaq-stream;
all send to one nats-server on this machine.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path

from recording import Bench, wait_until
from stream_bench import Server, Stream

SLAVES = 2


def cpu_seconds(process: subprocess.Popen[str] | subprocess.Popen[bytes]) -> float:
    fields = Path(f"/proc/{process.pid}/stat").read_text().rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def wait_seconds(seconds: float) -> None:
    """What is measured goes on meanwhile, or faults are at times, not on conditions."""
    time.sleep(seconds)


class Appliance:
    def __init__(self, folder: Path, number: int, server: Server) -> None:
        self.name = f"rig{number}"
        self.run_dir = Path(tempfile.mkdtemp(prefix="ecdaq-fleet-", dir="/dev/shm"))
        folder = folder / self.name
        folder.mkdir()
        self.bench = Bench(self.run_dir, folder)
        self.server = server

    def start(self, cycles: int) -> None:
        # Beginning in turns, as a fleet does: else all send in the same millisecond.
        self.producer = self.bench.produce("--cycles", str(cycles), "--pace", "--wait")
        self.stream = Stream(self.bench, self.server.port, stream_appliance=self.name)

    def end(self) -> None:
        self.bench.close()
        shutil.rmtree(self.run_dir)


def samples(server: Server) -> tuple[Counter[str], int]:
    """Of each appliance, and how many more of them are there more than once."""
    seen: dict[str, set[int]] = {}
    doubled = 0
    for message in server.messages():
        if message.subject.endswith(".block"):
            cycles = seen.setdefault(message.subject, set())
            doubled += len(cycles.intersection(message.cycles()))
            cycles.update(message.cycles())
    counts: Counter[str] = Counter()
    for subject, cycles in seen.items():
        counts[subject.split(".")[1]] += len(cycles)
    return counts, doubled


def main(count: int, seconds: int) -> None:
    with tempfile.TemporaryDirectory(prefix="ecdaq-stream-fleet-") as scratch:
        server = Server(Path(scratch) / "nats")
        server.create_stream()
        fleet = [Appliance(Path(scratch), number, server) for number in range(count)]
        cycles = seconds * 1000
        wanted = count * SLAVES * cycles
        try:
            assert server.process is not None
            before = cpu_seconds(server.process)
            for appliance in fleet:
                appliance.start(cycles)
            for appliance in fleet:
                assert appliance.producer.stdout is not None
                appliance.producer.stdout.readline()  # all its cycles are in its ring

            def is_quiet() -> bool:
                newest = server.state().last_seq
                wait_seconds(1)
                return bool(server.state().last_seq == newest)

            wait_until("the last sample in the stream", is_quiet, 120)
            broker = cpu_seconds(server.process) - before
            sending = sum(cpu_seconds(appliance.stream.process) for appliance in fleet)
            state = server.state()
            found, doubled = samples(server)
            arrived = sum(found.values())
            print(f"{count} appliances of {SLAVES} slaves, {cycles} cycles each, at 1 kHz, into one"
                  " nats-server")  # fmt: skip
            print(f"samples missing {wanted - arrived}, doubled {doubled}, of {wanted}")
            print(f"messages a second of an appliance {state.messages / count / seconds:9.1f}")
            print(f"bytes of a cycle in the stream    {state.bytes / count / cycles:9.1f}")
            print(f"ecdaq-stream, % of a processor    {100 * sending / count / seconds:9.2f}")
            print(f"nats-server, % for each appliance {100 * broker / count / seconds:9.2f}")
            assert (arrived, doubled) == (wanted, 0)
        finally:
            for appliance in fleet:
                appliance.end()
            server.kill()


if __name__ == "__main__":
    numbers = [int(word) for word in sys.argv[1:]]
    main(*(numbers + [50, 20][len(numbers) :]))
