# SPDX-License-Identifier: MIT
"""ecdaq-record on file systems that fill up or fail."""

from __future__ import annotations

import os
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest
from ecdaq import NOBODY
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
    status = bench.run_dir / "record/status"
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


@pytest.mark.skipif(os.geteuid() != 0, reason="needs root to become somebody else")
@pytest.mark.parametrize("is_sticky", [False, True], ids=["own", "sticky"])
def test_a_part_that_cannot_be_read_does_not_stop_recording(bench: Bench, is_sticky: bool) -> None:
    folder = bench.run_dir / "records"
    folder.mkdir()
    part = folder / "ecdaq-20260101T000000Z-00000001-000007.part"
    part.write_bytes(b"x")
    part.chmod(0o600)
    if is_sticky:  # others' files cannot even be renamed
        folder.chmod(0o1777)
    else:
        os.chown(folder, NOBODY, NOBODY)
    assert bench.produce("--cycles", "2000").wait(60) == 0
    ended = subprocess.run(
        [RECORD, "--run-dir", bench.run_dir, "--dir", folder, "--once",
         "--set", "record.reserve=0B"],
        capture_output=True, text=True, timeout=60, check=False, user=NOBODY, group=NOBODY,
    )  # fmt: skip
    assert ended.returncode == 0, ended.stderr
    assert ended.stderr.count("not recovered: Permission denied") == 1
    assert (part if is_sticky else part.with_suffix(".damaged")).read_bytes() == b"x"
    [made] = folder.glob("*.mcap")
    assert made.stem.endswith("-000008")
    bench.folder = folder
    assert sum(1 for _ in bench.messages("/ecdaq/cycle")) == 2000


def test_ended_without_recording_all_it_is_not_exit_0(bench: Bench) -> None:
    recorder = bench.start(
        *(RECORD, "--run-dir", bench.run_dir, "--dir", bench.folder),
        *("--set", "record.reserve=1TiB"),
    )
    status = bench.run_dir / "record/status"
    wait_until("status page", status.exists)
    assert bench.produce("--cycles", "100").wait(60) == 0
    wait_until("the alarm", lambda: b"recording stopped, disk full" in status.read_bytes())
    recorder.terminate()
    _, said = recorder.communicate(timeout=60)
    assert recorder.returncode == 1
    assert "ended without recording all: No space left on device" in said


@pytest.mark.skipif(os.geteuid() != 0, reason="needs root to mount a file system")
def test_a_disk_smaller_than_the_budget_has_the_newest(bench: Bench, thin: ThinDisk) -> None:
    small = thin.under / "tiny"
    small.mkdir()
    thin.run("mount", "-t", "tmpfs", "-o", "size=6m", "none", small)
    assert bench.produce("--cycles", "60000").wait(60) == 0
    recorder = bench.start(
        *thin.inside(RECORD, "--run-dir", bench.run_dir, "--dir", small, "--once"),
        *("--set", "record.compression=0", "--set", "record.reserve=1MiB"),
    )
    _, said = recorder.communicate(timeout=60)
    assert recorder.returncode == 0, said
    assert "disk full" not in said
    thin.run("cp", "-r", f"{small}/.", bench.folder)
    seen = [message.cycle for _, message in bench.messages("/ecdaq/cycle")]
    assert seen[0] > 0 and seen == list(range(seen[0], 60000))
    total = sum(path.stat().st_size for path in bench.folder.iterdir())
    assert 2 << 20 < total <= 5 << 20
