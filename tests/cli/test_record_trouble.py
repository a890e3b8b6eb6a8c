# SPDX-License-Identifier: MIT
"""ecdaq-record on file systems that fill up or fail."""

from __future__ import annotations

import os
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest
from recording import RECORD, Bench, wait_until


class ThinDisk:
    """ext4 without a journal on a sparse file on a small tmpfs, in a mount namespace of its own."""

    def __init__(self, under: Path) -> None:
        self.under = under
        self.image = under / "image"
        self.filler = under / "filler"
        self.disk = under / "disk"
        self.disk.mkdir()
        self.holder = subprocess.Popen(["unshare", "--mount", "sleep", "infinity"])
        here = os.readlink("/proc/self/ns/mnt")
        wait_until("namespace", lambda: os.readlink(f"/proc/{self.holder.pid}/ns/mnt") != here)

    def inside(self, *words: str | Path) -> list[str]:
        return ["nsenter", "--mount", f"--target={self.holder.pid}", *map(str, words)]

    def run(self, *words: str | Path) -> None:
        subprocess.run(self.inside(*words), check=True, timeout=60, capture_output=True)

    def make(self) -> None:
        # Not over the folder itself, in which this process makes mount points.
        small = self.under / "small"
        small.mkdir()
        self.run("mount", "-t", "tmpfs", "-o", "size=16m", "none", small)
        self.image, self.filler = small / "image", small / "filler"
        self.run("truncate", "--size=64M", self.image)
        self.run("mkfs.ext4", "-q", "-O", "^has_journal", "-E", "nodiscard", self.image)
        self.mount()

    def mount(self) -> None:
        self.run("mount", "-o", "loop", self.image, self.disk)

    def close(self) -> None:
        subprocess.run(self.inside("umount", self.disk), check=False, capture_output=True)
        self.holder.kill()
        self.holder.wait()


@pytest.fixture
def thin(tmp_path: Path) -> Iterator[ThinDisk]:
    made = ThinDisk(tmp_path)
    try:
        made.make()
    except subprocess.CalledProcessError as error:
        made.close()
        pytest.skip(f"no loop mount on this machine: {error.stderr!r}")
    yield made
    made.close()


@pytest.mark.skipif(os.geteuid() != 0, reason="needs root to mount a file system")
def test_a_sync_that_found_the_disk_full_costs_no_cycle(bench: Bench, thin: ThinDisk) -> None:
    cycles = 12_000
    recorder = bench.start(
        *thin.inside(RECORD, "--run-dir", bench.run_dir, "--dir", thin.disk, "--once"),
        *("--set", "record.compression=0", "--set", "record.reserve=0B"),
    )
    status = bench.run_dir / "record-status"
    wait_until("status page", status.exists)
    producer = bench.produce("--cycles", str(cycles), "--depth", "16384", "--pace")
    wait_until("ring", (bench.run_dir / "samples").exists)
    wait_until("samples", lambda: b"/disk/ecdaq-" in status.read_bytes())
    thin.run("sh", "-c", f"cat /dev/zero >{thin.filler} || true")
    wait_until("the alarm", lambda: b"recording stopped, disk full" in status.read_bytes())
    thin.run("rm", thin.filler)
    producer.wait(60)
    _, said = recorder.communicate(timeout=60)
    assert recorder.returncode == 0, said
    assert "disk full" in said and "recording again" in said
    # What the next boot finds, not what the page cache shows.
    thin.run("umount", thin.disk)
    thin.mount()
    thin.run("cp", "-r", f"{thin.disk}/.", bench.folder)
    seen = [message.cycle for _, message in bench.messages("/ecdaq/cycle")]
    assert seen == list(range(cycles))
    assert bench.log("check", bench.folder).returncode == 0
