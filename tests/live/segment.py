# SPDX-License-Identifier: MIT
"""A simulated segment, the master and the recorder in a network namespace, in real time."""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[2]
BIN = Path(os.environ.get("ECDAQ_BIN_DIR", ROOT / "build" / "stage" / "bin"))


# app/master/daemon/watch.c: so long without a frame, and the bus is no longer in OP.
SILENT_CYCLES = 50


class NeverError(AssertionError):
    """Something that had to happen did not."""


def wait_for(what: str, condition: Callable[[], Any], seconds: float) -> Any:
    """Poll @condition until it is true; its value, or NeverError naming @what."""
    end = time.monotonic() + seconds
    while True:
        value = condition()
        if value:
            return value
        if time.monotonic() > end:
            raise NeverError(f"after {seconds} s: no {what}")
        # A bounded poll of a condition, not a synchronisation by time.
        time.sleep(0.02)


class Namespace:
    """A network namespace with a veth pair ecat0 <-> ecsim0, held open by a process of our own."""

    def __init__(self) -> None:
        how = ["unshare", "--net", "--mount"]
        if os.geteuid() != 0:
            how = ["unshare", "--user", "--map-root-user", "--net", "--mount"]
        self.holder = subprocess.Popen(
            [*how, "sh", "-c", "echo ready; exec cat"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        assert self.holder.stdout is not None
        if self.holder.stdout.readline() != "ready\n":
            raise PermissionError("this user may not make a network namespace")
        self.enter = ["nsenter", "--target", str(self.holder.pid), "--net", "--mount"]
        if os.geteuid() != 0:
            self.enter += ["--user", "--preserve-credentials"]
        self.make_link()

    def make_link(self) -> None:
        self.run("ip", "link", "add", "ecat0", "type", "veth", "peer", "name", "ecsim0")
        for nic in ("ecat0", "ecsim0"):
            self.run("sysctl", "-qw", f"net.ipv6.conf.{nic}.disable_ipv6=1", check=False)
            self.run("ip", "link", "set", nic, "arp", "off", "multicast", "off", "up")

    def run(self, *command: str, check: bool = True) -> subprocess.CompletedProcess[str]:
        return subprocess.run(
            [*self.enter, *command], check=check, text=True, capture_output=True, timeout=60
        )

    def start(self, *command: str, log: Path) -> subprocess.Popen[bytes]:
        with log.open("ab") as out:
            return subprocess.Popen([*self.enter, *command], stdout=out, stderr=out)

    def close(self) -> None:
        assert self.holder.stdin is not None
        self.holder.stdin.close()
        self.holder.wait(10)


class Segment:
    """The programs, each started and ended by pid."""

    def __init__(
        self, folder: Path, slaves: str = "2", settings: dict[str, str] | None = None
    ) -> None:
        self.folder = folder
        self.slaves = slaves
        self.record_dir = folder / "record"
        self.run_dir = Path("/dev/shm") / f"ecdaq-live-{os.getpid()}-{folder.name}"
        self.run_dir.mkdir(mode=0o750)
        self.settings = {"bus.interface": "ecat0", "record.dir": str(self.record_dir)}
        # The clocks settle in so many frames, which take long on a busy machine.
        self.settings["dc.lock_timeout"] = "60s"
        self.settings |= settings or {}
        self.space = Namespace()
        self.processes: dict[str, subprocess.Popen[bytes]] = {}

    def options(self) -> list[str]:
        given = ["--run-dir", str(self.run_dir)]
        for name, value in self.settings.items():
            given += ["--set", f"{name}={value}"]
        return given

    def start(self, name: str, *command: str) -> subprocess.Popen[bytes]:
        process = self.space.start(*command, log=self.folder / f"{name}.log")
        self.processes[name] = process
        return process

    def start_sim(self, *more: str) -> None:
        priority = ["--priority", "50"] if os.geteuid() == 0 else []
        self.start(
            "sim",
            str(BIN / "ecdaq-sim"),
            *["--interface", "ecsim0", "--slaves", self.slaves, *priority, *more],
        )

    def start_daemon(self, *more: str) -> None:
        """A bring-up that fails ends it."""
        self.start_waiting_daemon("--exit-on-failure", *more)

    def start_waiting_daemon(self, *more: str) -> None:
        self.start("daemon", str(BIN / "ecdaqd"), *self.options(), *more)

    def start_recorder(self) -> None:
        self.start("recorder", str(BIN / "ecdaq-record"), *self.options())

    def start_all(self) -> None:
        self.start_sim()
        self.start_daemon()
        self.start_recorder()
        self.wait_for_op()

    def log(self, name: str) -> str:
        return (self.folder / f"{name}.log").read_text()

    def ecdaq(self, *arguments: str, check: bool = True) -> subprocess.CompletedProcess[str]:
        return self.space.run(
            str(BIN / "ecdaq"), "--run-dir", str(self.run_dir), *arguments, check=check
        )

    def status(self) -> dict[str, Any]:
        got = self.ecdaq("status", "--json", check=False)
        return json.loads(got.stdout) if got.returncode == 0 else {}

    def wait_for_op(self, seconds: float = 120) -> dict[str, Any]:
        def in_op() -> dict[str, Any]:
            daemon = self.processes["daemon"]
            if daemon.poll() is not None:
                raise NeverError(f"ecdaqd ended with {daemon.returncode}: {self.log('daemon')}")
            status = self.status()
            return status if status.get("state") == "OP" else {}

        return wait_for("OP", in_op, seconds)

    def wait_for_cycles(self, count: int, seconds: float) -> dict[str, Any]:
        start = self.status()["cycles"]

        def passed() -> dict[str, Any]:
            status = self.status()
            return status if status["cycles"] >= start + count else {}

        return wait_for(f"{count} cycles more", passed, seconds)

    def send(self, name: str, number: int) -> None:
        self.processes[name].send_signal(number)

    def stop(self, name: str, number: int = signal.SIGTERM) -> int:
        process = self.processes.pop(name)
        process.send_signal(number)
        return process.wait(60)

    def close(self) -> None:
        for name in ("watch", "sync0", "daemon", "recorder", "sim"):
            process = self.processes.pop(name, None)
            if process is not None and process.poll() is None:
                process.send_signal(signal.SIGCONT)
                process.terminate()
                try:
                    process.wait(30)
                except subprocess.TimeoutExpired:
                    process.kill()
                    process.wait(10)
        self.space.close()
        shutil.rmtree(self.run_dir)


class Undisturbed:
    """From here to check() the bus is in OP, unless this machine did not run master or segment for
    so long that it had to leave it. Whether something else delays frames is checked on virtual time
    (tests/sim)."""

    def __init__(self, segment: Segment) -> None:
        self.segment = segment
        self.before = segment.wait_for_op()
        self.left_before = self.left()

    def left(self) -> int:
        events = self.segment.ecdaq("events", "--json").stdout.splitlines()
        return sum(
            event["event"] == "bus_state" and event["text"].startswith("bus: OP -> RECOVERING")
            for event in map(json.loads, events)
        )

    def check(self) -> None:
        left = self.left() - self.left_before
        status = self.segment.wait_for_op()
        for key in ("pid", "session"):
            assert status[key] == self.before[key], key
        assert status["samples_bad_unexplained"] == 0
        counters = ("frames_lost", "cycles_skipped")
        bad = {key: status[key] - self.before[key] for key in counters}
        print(f"{left} times out of OP, {bad}")
        assert sum(bad.values()) >= left * SILENT_CYCLES, (left, bad)


def recorded(folder: Path, topic: str) -> Iterator[Any]:
    """Every decoded message of @topic in the recordings of @folder, oldest file first."""
    from mcap.reader import make_reader
    from mcap_ros2.decoder import DecoderFactory

    for path in sorted(folder.glob("*.mcap")):
        with path.open("rb") as file:
            reader = make_reader(file, decoder_factories=[DecoderFactory()])
            for _, channel, _, message in reader.iter_decoded_messages(topics=[topic]):
                assert channel.topic == topic
                yield message  # of the class that mcap-ros2-support makes from the schema
