# SPDX-License-Identifier: MIT
"""What anybody on the network can make ecdaq-dds write to the log is bounded."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

BIN = Path(os.environ.get("ECDAQ_BIN_DIR", Path(__file__).parents[2] / "build" / "stage" / "bin"))
PACKETS = 3000
# A DATA submessage that ends before its fields do.
SEND = """
import os, socket, sys
out = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
head = b"RTPS" + bytes([2, 1, 1, 16]) + bytes(12) + bytes([0x15, 5, 0x30, 0])
for _ in range(int(sys.argv[1])):
    for port in range(7410, 7414):
        out.sendto(head + os.urandom(8), ("127.0.0.1", port))
"""


@pytest.mark.skipif(os.geteuid() != 0, reason="needs root for a network namespace")
def test_malformed_packets_write_a_bounded_number_of_lines(tmp_path: Path) -> None:
    log = tmp_path / "log"
    script = tmp_path / "send.py"
    script.write_text(SEND)
    with log.open("w") as err:
        process = subprocess.Popen(
            ["unshare", "--net", "sh", "-c", 'ip link set lo up && exec "$@"', "sh",
             str(BIN / "ecdaq-dds"), "--run-dir", str(tmp_path),
             "--set", "dds.enable=on", "--set", "dds.interface=lo"],
            stderr=err,
        )  # fmt: skip
    began = time.monotonic()

    def send(count: int) -> None:
        inside = ["nsenter", f"--net=/proc/{process.pid}/ns/net"]
        subprocess.run(
            [*inside, sys.executable, str(script), str(count)],
            check=False, timeout=120, stderr=subprocess.DEVNULL,
        )  # fmt: skip

    try:
        while "malformed" not in log.read_text():  # it listens
            assert process.poll() is None, log.read_text()
            assert time.monotonic() < began + 120
            send(1)
        send(PACKETS)
        process.send_signal(signal.SIGTERM)
        assert process.wait(60) == 0, log.read_text()
    finally:
        process.kill()
        process.wait()
    seconds = time.monotonic() - began
    lines = [line for line in log.read_text().splitlines() if "DDS: " in line]
    assert len(lines) <= 22 + seconds / 10
    assert all(len(line) < 300 for line in lines)
    counts = [int(n) for n in re.findall(r"(\d+) more lines suppressed", "\n".join(lines))]
    assert sum(counts) > 100, lines
