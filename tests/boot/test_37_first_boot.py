# SPDX-License-Identifier: MIT
"""The first start of a disk that is larger than the image: the data partition grows to its end, and
a power cut at any moment of it costs nothing. Times are guest time.

ECDAQ_FIRST_BOOTS: how many disks of a first start that was cut are booted (2).
ECDAQ_POWER_CUT_SEED.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path
from random import Random

import pytest
from machine import BOOT_S, Machine, profile
from write_log import SECTOR, Fate, Partition, WriteLog

CUTS = int(os.environ.get("ECDAQ_FIRST_BOOTS", "2"))
SEED = int(os.environ.get("ECDAQ_POWER_CUT_SEED", "1"))
GB = 10**9
SIZES_BYTES = (8 * GB, 512 * GB)
# What ext4 takes of it for its own tables.
USABLE_PART = 0.97
BAD_WORDS = ("cannot be repaired", "not grown", "memory instead of the data partition")
FILES = {"ecdaq.yaml": profile("guest")}


def up(machine: Machine) -> None:
    machine.wait_for_login()
    machine.wait_until("SSH answers", "true", BOOT_S)
    machine.wait_until("the end of the start", "systemctl is-system-running | grep -qv starting")


def check_up(machine: Machine, disk_bytes: int) -> int:
    """The machine is whole; the free bytes of its data partition."""
    console = machine.console_of_this_boot()
    assert [words for words in BAD_WORDS if words in console] == []
    start, sectors = machine.partitions()["data"]
    assert (start + sectors) * SECTOR > disk_bytes - (16 << 20)
    machine.run("sudo test -s /etc/ssh/ssh_host_ed25519_key")
    size, free = machine.run("df --output=size,avail -B1 /data | tail -n 1").split()
    assert int(size) > USABLE_PART * sectors * SECTOR
    return int(free)


@pytest.fixture(scope="module", params=SIZES_BYTES, ids=lambda size: f"{size // GB} GB")
def fresh(
    request: pytest.FixtureRequest, image: Path, key: Path, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[tuple[Machine, int]]:
    """A machine that was never started, and the size of its disk."""
    size: int = request.param
    machine = Machine(tmp_path_factory.mktemp("vm"), image, key, "guest", None, size)
    machine.write_boot_files(FILES | {"authorized_keys": key.with_suffix(".pub").read_text()})
    yield machine, size
    machine.stop()


def test_a_first_start_uses_the_whole_disk_and_costs_little_time(
    fresh: tuple[Machine, int],
) -> None:
    machine, size = fresh
    is_logged = size == min(SIZES_BYTES)
    machine.start(log_writes=is_logged)
    up(machine)
    free = check_up(machine, size)
    first = machine.run("systemd-analyze time").splitlines()[0]
    machine.run("sync")
    machine.cut_power()
    print(f"\ndisk of {size / GB:.0f} GB: {free / GB:.1f} GB free for recordings")
    print(f"  first start: {first}")
    machine.start()
    up(machine)
    assert free * 0.9 < check_up(machine, size) <= free
    print(f"  second start: {machine.run('systemd-analyze time').splitlines()[0]}", flush=True)
    machine.stop()
    if is_logged:
        cut(machine, size)


def cut(machine: Machine, size: int) -> None:
    """Disks that cuts at moments of the first start would have left, each booted."""
    log_file, base = machine.folder / "first.log", machine.folder / "first.img"
    machine.write_log.rename(log_file)
    machine.disk_before.rename(base)
    log = WriteLog(log_file)
    disk = Partition(log, base, machine.folder / "durable", 0, size // SECTOR)
    for number in range(1, CUTS + 1):
        count = len(log.entries) * number // (CUTS + 1)
        disk.go_to(count)
        disk.leave(machine.disk, Fate.TORN, Random(f"{SEED}:{number}"))
        machine.start()
        up(machine)
        check_up(machine, size)
        machine.stop()
        print(
            f"  cut {number}: behind {count} of {len(log.entries)} writes and flushes,"
            f" {len(disk.pending)} of them not flushed: the next start is good",
            flush=True,
        )
