# SPDX-License-Identifier: MIT
"""What the tests of ecdaq-record share: rings without a bus, the recorder, its recordings."""

from __future__ import annotations

import contextlib
import subprocess
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from ecdaq import BIN, BUILD, ECDAQ
from mcap.reader import NonSeekingReader, make_reader
from mcap_ros2.decoder import DecoderFactory

RECORD = BIN / "ecdaq-record"
PRODUCER = BUILD / "tests" / "cli" / "test_ring_producer"


def wait_until(what: str, ready: Callable[[], bool], seconds: float = 60) -> None:
    end = time.monotonic() + seconds
    while not ready():
        assert time.monotonic() < end, f"{what}: not within {seconds} s"
        time.sleep(0.02)


class Bench:
    """Rings in one folder, recordings in another, and the processes between them."""

    def __init__(self, run_dir: Path, folder: Path) -> None:
        self.run_dir = run_dir
        self.folder = folder
        self.processes: list[subprocess.Popen[str]] = []

    def start(self, *command: str | Path) -> subprocess.Popen[str]:
        process = subprocess.Popen(
            [str(word) for word in command],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        self.processes.append(process)
        return process

    def produce(self, *options: str) -> subprocess.Popen[str]:
        return self.start(PRODUCER, self.run_dir, *options)

    def record(self, *options: str) -> subprocess.Popen[str]:
        return self.start(
            RECORD, "--run-dir", self.run_dir, "--dir", self.folder,
            "--set", "record.reserve=0B", *options,
        )  # fmt: skip

    def record_all(self, *options: str) -> str:
        """Record a session that has ended; its messages."""
        process = self.record("--once", *options)
        _, output = process.communicate(timeout=60)
        assert process.returncode == 0, output
        return output

    def recorded_bytes(self) -> int:
        """Of all files; one that is renamed meanwhile does not count."""
        total = 0
        for path in self.folder.glob("ecdaq-*"):
            with contextlib.suppress(FileNotFoundError):
                total += path.stat().st_size
        return total

    def log(self, *words: str | Path) -> subprocess.CompletedProcess[str]:
        return subprocess.run(
            [ECDAQ, "log", *words], capture_output=True, text=True, timeout=60, check=False
        )

    def files(self) -> list[Path]:
        return sorted(self.folder.glob("*.mcap"))

    def messages(self, topic: str) -> Iterator[tuple[int, Any]]:
        for path in self.files():
            with path.open("rb") as file:
                reader = make_reader(file, decoder_factories=[DecoderFactory()], validate_crcs=True)
                for _, _, raw, message in reader.iter_decoded_messages(topics=[topic]):
                    yield raw.log_time, message

    def raw_messages(self, topic: str) -> Iterator[tuple[int, bytes]]:
        """Log time and data; of a file being written, too."""
        for path in sorted(self.folder.glob("ecdaq-*")):
            with path.open("rb") as file:
                for _, channel, raw in NonSeekingReader(file).iter_messages(topics=[topic]):
                    assert channel.topic == topic
                    yield raw.log_time, raw.data

    def schemas(self) -> dict[str, tuple[str, str, str]]:
        """Name, encoding and text of the schema of each topic."""
        found = {}
        for path in self.files():
            with path.open("rb") as file:
                summary = make_reader(file).get_summary()
                assert summary is not None
                for channel in summary.channels.values():
                    schema = summary.schemas[channel.schema_id]
                    found[channel.topic] = (schema.name, schema.encoding, schema.data.decode())
        return found

    def close(self) -> None:
        for process in self.processes:
            if process.poll() is None:
                process.kill()
            process.communicate()
