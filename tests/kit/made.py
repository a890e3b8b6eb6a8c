# SPDX-License-Identifier: MIT
"""Recordings for the tests of the kit, by ecdaq-record; what independent readers find in them."""

from __future__ import annotations

import os
import shutil
import struct
import subprocess
import tempfile
import zlib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import pytest
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory

ROOT = Path(__file__).resolve().parents[2]
KIT = ROOT / "app" / "services" / "publish" / "python"
BIN = Path(os.environ.get("ECDAQ_BIN_DIR", ROOT / "build" / "stage" / "bin"))
PRODUCER = (
    Path(os.environ.get("ECDAQ_BUILD", ROOT / "build" / "release"))
    / "tests" / "cli" / "test_ring_producer"
)  # fmt: skip
PERIOD_NS = 1_000_000
MAGIC = b"\x89MCAP0\r\n"


def run(*command: str | Path, env: Mapping[str, str] = os.environ) -> None:
    done = subprocess.run(
        command, capture_output=True, text=True, timeout=120, check=False, env=env
    )
    assert done.returncode == 0, done.stderr


def clock_environment(clock: str) -> dict[str, str]:
    """Of a program that finds @clock ("" as it is): see tests/cli/clock_quality.c."""
    shim = PRODUCER.parent / "libtest_clock_quality.so"
    return dict(os.environ) | (
        {"LD_PRELOAD": str(shim), "ECDAQ_TEST_CLOCK": clock} if clock else {}
    )


def make(
    folder: Path, options: Sequence[str], settings: Sequence[str] = (), clock: str = ""
) -> Path:
    """Record one session into @folder. @clock: of the host."""
    for program in (PRODUCER, BIN / "ecdaq-record"):
        if not program.exists():
            pytest.fail(f"{program} is not there: run ./build.sh build")
    folder.mkdir(exist_ok=True)
    run_dir = Path(tempfile.mkdtemp(prefix="ecdaq-kit-", dir="/dev/shm"))
    try:
        run(PRODUCER, run_dir, *options)
        words = [w for s in ("record.reserve=0B", *settings) for w in ("--set", s)]
        command = [BIN / "ecdaq-record", "--run-dir", run_dir, "--dir", folder, "--once", *words]
        run(*command, env=clock_environment(clock))
    finally:
        shutil.rmtree(run_dir)
    return folder


def files(folder: Path) -> list[Path]:
    return sorted(folder.glob("*.mcap*"), key=lambda path: path.name[-20:])


def decoded(path: Path) -> dict[str, list[tuple[int, Any]]]:
    """Log time and message of each topic, as the packages mcap and mcap-ros2-support read them."""
    found: dict[str, list[tuple[int, Any]]] = {}
    with path.open("rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()], validate_crcs=True)
        for _, channel, raw, message in reader.iter_decoded_messages():
            found.setdefault(channel.topic, []).append((raw.log_time, message))
    return found


def metadata_of(path: Path, topic: str) -> dict[str, str]:
    """The metadata of a channel of MCAP."""
    with path.open("rb") as file:
        summary = make_reader(file).get_summary()
    assert summary is not None
    return next(c.metadata for c in summary.channels.values() if c.topic == topic)


def record(opcode: int, content: bytes) -> bytes:
    return struct.pack("<BQ", opcode, len(content)) + content


def text(value: str) -> bytes:
    return struct.pack("<I", len(value)) + value.encode()


def pairs(values: dict[str, str]) -> bytes:
    joined = b"".join(text(key) + text(value) for key, value in values.items())
    return struct.pack("<I", len(joined)) + joined


def unfinished(chunks: Sequence[bytes], head: bytes = b"") -> bytes:
    """A file without summary; the content of each chunk is a sequence of records."""
    found = MAGIC + record(1, text("ros2") + text("test")) + head
    for content in chunks:
        found += record(
            6,
            struct.pack("<QQQI", 0, 2**64 - 1, len(content), zlib.crc32(content))
            + text("") + struct.pack("<Q", len(content)) + content,
        )  # fmt: skip
    return found


def topic(number: int, name: str, schema: str, metadata: dict[str, str]) -> bytes:
    """Schema and channel of a topic."""
    return record(
        3, struct.pack("<H", number) + text(f"test_msgs/msg/T{number}") + text("ros2msg")
        + text(schema),
    ) + record(
        4, struct.pack("<HH", number, number) + text(name) + text("cdr") + pairs(metadata)
    )  # fmt: skip


def message(channel: int, time_ns: int, data: bytes) -> bytes:
    return record(5, struct.pack("<HIQQ", channel, 0, time_ns, time_ns) + data)
