# SPDX-License-Identifier: MIT
"""Files to and from slaves, and a firmware update with what may go wrong in it."""

from __future__ import annotations

import json
import signal
import struct
import subprocess
import zlib
from collections.abc import Callable
from pathlib import Path

from bus import tell
from segment import BIN, NeverError, Segment, wait_for

REFUSED = 17
FAILED = 1
INIT, PREOP, BOOT = 1, 2, 3  # AL states
PICCOLO = 0x04570862
LONG = 110_000  # bytes of program: seconds on their way, and nearly all that the board takes


def image(version: str, length: int = 5_000) -> bytes:
    """A file as the firmware of the simulated board takes it."""
    program = bytes(i * 17 % 256 for i in range(length))
    header = struct.pack("<4sIII", b"PIC1", PICCOLO, length, zlib.crc32(program))
    return header + version.encode().ljust(16, b"\0") + program


class Held:
    """A segment whose bus is held in PRE-OP."""

    def __init__(self, make: Callable[..., Segment], slaves: str = "2") -> None:
        self.segment = make(slaves=slaves, settings={"bus.target": "preop"})
        self.control = self.segment.folder / "control"
        self.segment.start_sim("--control", str(self.control))
        wait_for("control socket", self.control.exists, 30)
        self.segment.start_waiting_daemon()
        wait_for("PREOP", lambda: self.segment.status().get("state") == "PREOP", 60)
        self.file = self.segment.folder / "firmware.bin"

    def state(self, slave: str) -> int:
        """AL status, from the register."""
        got = self.segment.ecdaq("reg", "read", slave, "0x0130", "--json")
        return int(json.loads(got.stdout)["value"])

    def version(self, slave: str) -> str:
        return self.segment.ecdaq("sdo", "read", slave, "0x100a", "--type", "STRING").stdout.strip()

    def update(self, *more: str) -> subprocess.CompletedProcess[str]:
        return self.segment.ecdaq("firmware", "piccolo1", str(self.file), *more, check=False)

    def is_seen_in_boot(self, update: subprocess.Popen[str]) -> bool:
        wait_for("BOOT", lambda: self.state("piccolo1") == BOOT or update.poll() == 0, 60)
        return update.poll() is None

    def start_update(self) -> subprocess.Popen[str]:
        """Begun, and the file is on its way. One that was over before this was seen is repeated."""
        command = [str(BIN / "ecdaq"), "--run-dir", str(self.segment.run_dir)]
        for _ in range(10):
            process = subprocess.Popen(
                [*command, "firmware", "piccolo1", str(self.file)],
                stdout=subprocess.DEVNULL,
                stderr=subprocess.PIPE,
                text=True,
            )
            if self.is_seen_in_boot(process):
                return process
            process.communicate()
        raise NeverError("no update was seen while it ran")


def test_an_update_shows_the_version_before_and_after(make_segment: Callable[..., Segment]) -> None:
    bus = Held(make_segment)
    old = bus.version("piccolo1")
    bus.file.write_bytes(image("7.1"))
    shown = json.loads(bus.update("--json").stdout)
    assert shown["before"]["version"] == old
    assert shown["after"]["version"] == "7.1"
    assert shown["before"]["sii_revision"] == shown["after"]["sii_revision"] is not None
    assert (shown["name"], shown["length"]) == ("piccolo1", bus.file.stat().st_size)
    assert shown["state"] == "PRE-OP"
    assert bus.version("piccolo0") == old
    bus.segment.ecdaq("state", "INIT", "piccolo1")
    bus.file.write_bytes(image("7.2"))
    got = bus.update()
    assert got.returncode == 0, got.stderr
    assert "not known -> 7.2" in got.stdout
    assert bus.state("piccolo1") == INIT
    bus.segment.ecdaq("state", "OP")
    assert bus.version("piccolo1") == "7.2"
    refused = bus.update()
    assert refused.returncode == REFUSED
    assert "slave 1 (piccolo1) is in OP: ecdaq state PREOP all first" in refused.stderr


def test_a_refused_file_leaves_boot_and_the_old_version(
    make_segment: Callable[..., Segment],
) -> None:
    bus = Held(make_segment)
    old = bus.version("piccolo1")
    bus.file.write_bytes(image("7.3")[:-1])
    got = bus.update()
    assert got.returncode == REFUSED
    assert "length or CRC-32 wrong" in got.stderr
    assert "slave 1 (piccolo1) is in BOOT: repeat ecdaq firmware" in got.stderr
    assert bus.state("piccolo1") == BOOT
    bus.segment.ecdaq("state", "PREOP", "piccolo1")
    assert bus.version("piccolo1") == old
    bus.file.write_bytes(image("7.3"))
    assert bus.update().returncode == 0
    assert bus.version("piccolo1") == "7.3"


def test_an_interrupted_update_says_where_the_slave_is_and_can_be_repeated(
    make_segment: Callable[..., Segment],
) -> None:
    bus = Held(make_segment)
    bus.file.write_bytes(image("7.4", LONG))
    process = bus.start_update()
    process.send_signal(signal.SIGINT)
    _, said = process.communicate(timeout=60)
    assert process.returncode == FAILED
    assert "interrupted; slave 1 (piccolo1) is in BOOT" in said
    assert bus.state("piccolo1") == BOOT
    assert bus.update().returncode == 0
    assert bus.version("piccolo1") == "7.4"


def test_a_power_cut_in_the_middle_is_reported_and_the_update_can_be_repeated(
    make_segment: Callable[..., Segment],
) -> None:
    bus = Held(make_segment)
    bus.file.write_bytes(image("7.5", LONG))
    process = bus.start_update()
    assert tell(bus.control, "at=0s power-off slave=1") == "ok"
    _, said = process.communicate(timeout=120)
    assert process.returncode == REFUSED
    assert "FoE write of firmware.bin" in said
    assert "slave 1 (piccolo1) does not answer" in said
    assert tell(bus.control, "at=0s power-on slave=1") == "ok"
    there = ["reg", "read", "piccolo1", "0x0130"]
    wait_for("slave", lambda: bus.segment.ecdaq(*there, check=False).returncode == 0, 60)
    shown = json.loads(bus.update("--json").stdout)
    assert (shown["after"]["version"], shown["state"]) == ("7.5", "INIT")


def test_a_file_needs_its_password_and_comes_back(
    make_segment: Callable[..., Segment], tmp_path: Path
) -> None:
    bus = Held(make_segment, slaves="akd,ek1914")
    tell(bus.control, "io slave=0 foe.password=4711")
    bus.file.write_bytes(bytes(range(256)) * 20)
    got = bus.segment.ecdaq("foe", "write", "0", str(bus.file), "--name", "a.cfg", check=False)
    assert got.returncode == REFUSED
    assert "FoE write of a.cfg: no access rights (0x800a)" in got.stderr
    words = ["--name", "a.cfg", "--password", "4711"]
    written = bus.segment.ecdaq("foe", "write", "0", str(bus.file), *words)
    assert written.stdout == "a.cfg: 5120 bytes written\n"
    back = tmp_path / "back"
    bus.segment.ecdaq("foe", "read", "0", "a.cfg", "--password", "4711", "-o", str(back))
    assert back.read_bytes() == bus.file.read_bytes()
    got = bus.segment.ecdaq("foe", "read", "0", "a.cfg", "--password", "4711", "--json")
    shown = json.loads(got.stdout)
    assert bytes.fromhex(shown["bytes"]) == bus.file.read_bytes()
    got = bus.segment.ecdaq("firmware", "1", str(bus.file), check=False)
    assert got.returncode == REFUSED
    assert "its SII gives no mailbox for BOOT: it has no such state" in got.stderr
    assert bus.state("1") == PREOP
