# SPDX-License-Identifier: MIT
"""The frames of a running bus as a capture file."""

from __future__ import annotations

import json
import signal
import struct
import subprocess
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

import pytest
from segment import BIN, Segment, Undisturbed, wait_for

INBOUND, OUTBOUND = 1, 2
APRD, APWR, FPWR, BRD, BWR = 1, 2, 5, 7, 8
RING_FRAMES = 4096  # app/master/daemon/capture_requests.c


class Frame(NamedTuple):
    utc_ns: int
    direction: int
    data: bytes
    dropped: int  # frames that are missing before it

    def commands(self) -> list[int]:
        found, at = [], 16
        while at + 10 <= len(self.data):
            length = struct.unpack_from("<H", self.data, at + 6)[0]
            found.append(self.data[at])
            at += 12 + (length & 0x7FF)
            if not length & 0x8000:
                break
        return found


def blocks(data: bytes) -> Iterator[tuple[int, bytes]]:
    at = 0
    while at < len(data):
        kind, length = struct.unpack_from("<II", data, at)
        assert length % 4 == 0 and struct.unpack_from("<I", data, at + length - 4)[0] == length
        yield kind, data[at + 8 : at + length - 4]
        at += length


def read_pcapng(path: Path) -> list[Frame]:
    """Every block is whole; one section, one Ethernet interface with times in ns."""
    found = list(blocks(path.read_bytes()))
    assert [kind for kind, _ in found[:2]] == [0x0A0D0D0A, 1]
    assert struct.unpack_from("<I", found[0][1])[0] == 0x1A2B3C4D
    assert struct.unpack_from("<H", found[1][1])[0] == 1
    assert b"ecat0" in found[1][1] and struct.pack("<HHB", 9, 1, 9) in found[1][1]
    frames = []
    for kind, body in found[2:]:
        assert kind == 6
        interface, high, low, kept, wire = struct.unpack_from("<5I", body)
        assert (interface, kept) == (0, wire)
        options = body[20 + (kept + 3) // 4 * 4 :]
        code, length, flags = struct.unpack_from("<HHI", options)
        assert (code, length) == (2, 4)
        dropped = 0
        if options[8:12] == struct.pack("<HH", 4, 8):
            dropped = struct.unpack_from("<Q", options, 12)[0]
        frames.append(Frame(high << 32 | low, flags, body[20 : 20 + kept], dropped))
    return frames


@pytest.fixture
def bus(make_segment: Callable[..., Segment]) -> Segment:
    segment = make_segment(slaves="el3104,el3104")
    segment.start_sim()
    segment.start_daemon()
    segment.wait_for_op()
    return segment


def capture(bus: Segment, file: Path, *words: str) -> Any:
    got = bus.ecdaq("pcap", "--output", str(file), "--json", *words, check=False)
    assert (got.returncode, got.stderr) == (0, "")
    return json.loads(got.stdout)


def start_capture(bus: Segment, file: Path, *words: str) -> subprocess.Popen[bytes]:
    command = [str(BIN / "ecdaq"), "--run-dir", str(bus.run_dir), "pcap", "-o", str(file), *words]
    process = bus.start("pcap", *command)
    wait_for("frames in the file", lambda: file.exists() and file.stat().st_size > 0, 60)
    return process


def test_cyclic_frames_are_captured_out_and_in(bus: Segment, tmp_path: Path) -> None:
    undisturbed = Undisturbed(bus)
    file = tmp_path / "a.pcapng"
    shown = capture(bus, file, "--count", "400")
    assert (shown["file"], shown["frames"]) == (str(file), 400)
    frames = read_pcapng(file)
    assert len(frames) == 400
    assert all(frame.data[12:14] == b"\x88\xa4" for frame in frames)
    for direction in (INBOUND, OUTBOUND):
        cyclic = [f for f in frames if f.direction == direction and {10, 12} & {*f.commands()}]
        assert len(cyclic) > 50
        assert [f.utc_ns for f in cyclic] == sorted(f.utc_ns for f in cyclic)
    undisturbed.check()


def test_a_mailbox_transfer_is_captured_too(bus: Segment, tmp_path: Path) -> None:
    file = tmp_path / "a.pcapng"
    start_capture(bus, file)
    bus.ecdaq("sdo", "read", "0", "0x1018:1")
    assert bus.stop("pcap", signal.SIGINT) == 0
    commands = {c for frame in read_pcapng(file) for c in frame.commands()}
    assert FPWR in commands


def test_a_rescan_is_captured_from_its_first_frame_on(bus: Segment, tmp_path: Path) -> None:
    file = tmp_path / "a.pcapng"
    start_capture(bus, file)
    bus.ecdaq("rescan", "--force")
    assert bus.stop("pcap", signal.SIGINT) == 0
    frames = read_pcapng(file)
    commands = {c for frame in frames for c in frame.commands()}
    # First station addresses are cleared and given, slave by slave. A reader that did not run for a
    # third of a second has missed frames, and the file says so.
    assert {APRD, APWR, BRD, BWR} <= commands or any(frame.dropped for frame in frames)


def test_frames_that_were_not_read_in_time_are_counted_in_the_file(
    bus: Segment, tmp_path: Path
) -> None:
    undisturbed = Undisturbed(bus)
    file = tmp_path / "a.pcapng"
    start_capture(bus, file, "--json")
    bus.send("pcap", signal.SIGSTOP)
    bus.wait_for_cycles(RING_FRAMES, 120)
    bus.send("pcap", signal.SIGCONT)
    size = file.stat().st_size
    wait_for("frames after the gap", lambda: file.stat().st_size > size + 10_000, 60)
    assert bus.stop("pcap", signal.SIGINT) == 0
    shown = json.loads(bus.log("pcap"))
    frames = read_pcapng(file)
    assert len(frames) == shown["frames"]
    assert 0 < sum(frame.dropped for frame in frames) <= shown["missed"]
    undisturbed.check()


def test_a_capture_into_a_pipe_says_on_standard_error_how_many(bus: Segment) -> None:
    command = [str(BIN / "ecdaq"), "--run-dir", str(bus.run_dir), "pcap", "--count", "20"]
    got = subprocess.run([*bus.space.enter, *command], capture_output=True, timeout=60)
    assert got.returncode == 0
    assert got.stdout[:4] == b"\n\r\r\n"
    assert got.stderr == b"ecdaq: pcap: 20 frames, 0 missed\n"


def test_a_capture_ends_with_ecdaqd(bus: Segment, tmp_path: Path) -> None:
    file = tmp_path / "a.pcapng"
    process = start_capture(bus, file)
    bus.stop("daemon")
    assert process.wait(60) == 16
    bus.processes.pop("pcap")
    assert read_pcapng(file)
