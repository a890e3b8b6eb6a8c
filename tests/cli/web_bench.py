# SPDX-License-Identifier: MIT
"""ecdaq-web on rings without a bus."""

from __future__ import annotations

import os
import socket
from pathlib import Path

from ecdaq import BIN
from recording import Bench, wait_until

WEB = BIN / "ecdaq-web"
SECONDS = 60


def free_port() -> int:
    with socket.socket() as sock:
        sock.bind(("127.0.0.1", 0))
        return sock.getsockname()[1]


class Web:
    """ecdaq-web on the rings of a bench."""

    def __init__(self, bench: Bench, config: Path | None = None, **settings: str) -> None:
        self.bench = bench
        given = {"web.enable": "on", "web.port": str(free_port())} | settings
        self.port = int(given["web.port"])
        words = [w for name, value in given.items() for w in ("--set", f"{name}={value}")]
        if config is not None:
            words += ["--config", str(config)]
        # What AddressSanitizer keeps of freed memory would count as memory of the program.
        keep_none = "ASAN_OPTIONS=quarantine_size_mb=0:thread_local_quarantine_size_kb=0"
        self.process = bench.start("env", keep_none, WEB, "--run-dir", bench.run_dir, *words)
        wait_until("a listening ecdaq-web", self.listens)

    def listens(self) -> bool:
        assert self.process.poll() is None, self.process.communicate()
        with socket.socket() as sock:
            return sock.connect_ex(("127.0.0.1", self.port)) == 0

    def stop(self) -> str:
        """Its messages."""
        self.process.terminate()
        _, errors = self.process.communicate(timeout=SECONDS)
        assert self.process.returncode == 0, errors
        return errors

    def cpu_seconds(self) -> float:
        """Of the process, and of those that it has started and that have ended."""
        fields = Path(f"/proc/{self.process.pid}/stat").read_text().rsplit(")", 1)[1].split()
        return sum(int(field) for field in fields[11:15]) / os.sysconf("SC_CLK_TCK")

    def resident_bytes(self) -> int:
        pages = int(Path(f"/proc/{self.process.pid}/statm").read_text().split()[1])
        return pages * os.sysconf("SC_PAGE_SIZE")
