# SPDX-License-Identifier: MIT
"""Stream and uplink of two appliances while JetStream and object store are killed at random.

python tests/cli/kill_figures.py [MINUTES [SEED]]

Each appliance records and streams two slaves at 1 kHz and uploads its recordings, a file each
few seconds. nats-server and the store (gofakes3, with its data on disk) are killed and started
again at random times, for 10 minutes by default. Then each cycle of each slave has to be in the
stream once, and each recording in the store once and byte by byte.
"""

from __future__ import annotations

import random
import shutil
import sys
import tempfile
import time
from pathlib import Path

from recording import Bench, wait_until
from stream_bench import Server, Stream
from stream_fleet import SLAVES, samples, wait_seconds
from uplink_bench import GoFake, Uplink

APPLIANCES = 2
DOWN_S, UP_S = 4, 8  # at most


class Appliance:
    def __init__(self, folder: Path, number: int, server: Server, store: GoFake) -> None:
        self.name = f"rig{number}"
        self.run_dir = Path(tempfile.mkdtemp(prefix="ecdaq-kill-", dir="/dev/shm"))
        (folder / self.name).mkdir()
        self.bench = Bench(self.run_dir, folder / self.name)
        self.server = server
        self.uplink = Uplink(self.bench, store, uplink_appliance=self.name)

    def start(self, cycles: int) -> None:
        self.producer = self.bench.produce("--cycles", str(cycles), "--pace", "--wait")
        wait_until("the ring", (self.run_dir / "samples").exists)
        self.recorder = self.bench.record("--set", "record.rotate_size=1MiB")
        self.stream = Stream(self.bench, self.server.port, stream_appliance=self.name)
        self.uplink.start()

    def key(self, path: Path) -> str:
        return f"plant/a/{self.name}/{path.name}"

    def finish(self) -> None:
        """All cycles are made: the last recording ends, all are uploaded."""
        assert self.producer.stdout is not None
        self.producer.stdout.readline()
        self.producer.communicate("", timeout=60)
        self.recorder.terminate()
        self.recorder.communicate(timeout=60)
        wait_until(
            "all uploaded",
            lambda: len(self.uplink.uploaded()) == len(self.bench.files()),
            300,
        )

    def end(self) -> None:
        self.bench.close()
        shutil.rmtree(self.run_dir)


def kill_at_random(seconds: float, victims: list[Server | GoFake], seed: int) -> list[int]:
    """How often each was killed."""
    chance = random.Random(seed)
    kills = [0] * len(victims)
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        wait_seconds(chance.random() * UP_S)
        n = chance.randrange(len(victims))
        victims[n].kill()
        kills[n] += 1
        wait_seconds(chance.random() * DOWN_S)
        victims[n].start()
    return kills


def check_store(fleet: list[Appliance], store: GoFake, cycles: int) -> None:
    objects = store.keys()
    files = [(a, path) for a in fleet for path in a.bench.files()]
    wanted = sorted(key for a, path in files for key in (a.key(path), f"{a.key(path)}.json"))
    different = sum(store.get(a.key(path)) != path.read_bytes() for a, path in files)
    print(
        f"recordings: {len(files)} uploaded, {len(set(wanted) - set(objects))} objects missing,"
        f" {len(objects) - len(set(wanted))} too many, {different} different"
    )
    assert sorted(objects) == wanted and different == 0
    for appliance in fleet:
        manifests = [store.manifest(appliance.key(p)) for p in appliance.bench.files()]
        recorded = sum(m["cycles"] for m in manifests)
        print(f"{appliance.name}: {recorded} of {cycles} cycles in its recordings")
        assert recorded == cycles


def main(minutes: float, seed: int) -> None:
    with tempfile.TemporaryDirectory(prefix="ecdaq-kill-") as scratch:
        folder = Path(scratch)
        server, store = Server(folder / "nats"), GoFake(folder / "store")
        server.create_stream()
        fleet = [Appliance(folder, number, server, store) for number in range(APPLIANCES)]
        cycles = int(minutes * 60_000)
        try:
            for appliance in fleet:
                appliance.start(cycles)
            kills = kill_at_random(minutes * 60, [server, store], seed)
            for appliance in fleet:
                appliance.finish()
            wait_until(
                "the last cycle of all in the stream",
                lambda: sum(samples(server)[0].values()) >= APPLIANCES * SLAVES * cycles,
                300,
            )
            counts, doubled = samples(server)
            missing = APPLIANCES * SLAVES * cycles - sum(counts.values())
            print(f"{APPLIANCES} appliances, {minutes:g} minutes at 1 kHz; killed: nats-server"
                  f" {kills[0]} times, the object store {kills[1]} times")  # fmt: skip
            print(f"stream: {sum(counts.values())} samples, {missing} missing, {doubled} doubled")
            assert (missing, doubled) == (0, 0)
            check_store(fleet, store, cycles)
        finally:
            for appliance in fleet:
                appliance.end()
            server.kill()
            store.kill()


if __name__ == "__main__":
    given = [float(word) for word in sys.argv[1:]]
    main(given[0] if given else 10, int(given[1]) if len(given) > 1 else 1)
