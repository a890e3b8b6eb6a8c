# SPDX-License-Identifier: MIT
"""The power fails at random moments: the machine boots again, its file system is repaired by
its journal alone, and the recordings open. Then many cuts without a boot: disks that a cut would
have left, made from the log of what the machine wrote.

In guest time, so that the moments are spread over the guest's second and not over the host's load.
ECDAQ_POWER_CUTS: how many (1). ECDAQ_CUT_DISKS: how many disks (200). ECDAQ_POWER_CUT_SEED.
"""

from __future__ import annotations

import json
import os
import random
import subprocess
from pathlib import Path
from typing import Any

import pytest
from cut_disks import Acknowledged, Source, examine_all, is_bad, table
from machine import Machine, profile, wait_for
from write_log import SECTOR, Fate, Partition, WriteLog, copy_sparse

# Files are finished, renamed and begun also within the seconds of a test.
BOOT_FILES = {"ecdaq.yaml": profile("guest") + "record:\n  rotate_period: 3s\n"}
START = {"log_writes": True}
CUTS = int(os.environ.get("ECDAQ_POWER_CUTS", "1"))
DISKS = int(os.environ.get("ECDAQ_CUT_DISKS", "200"))
SEED = int(os.environ.get("ECDAQ_POWER_CUT_SEED", "1"))
OP_S = 900
# What a cut may cost at most: one record.sync_period (1 s) and one record.chunk_period (100 ms),
# and the time the disk takes.
LOSS_LIMIT_CYCLES = 2000
# How much is recorded while all writes are logged: more disks, more places to cut.
LOGGED_CYCLES = max(10000, 6 * DISKS)
# What is written beside the recordings: files come and go, some synced, some past the cache.
NOISE = """
while :; do
    mkdir /data/made
    for file in $(seq 30); do echo $file > /data/made/$file; done
    dd if=/dev/urandom of=/data/made/direct bs=16k count=16 oflag=direct status=none
    dd if=/dev/urandom of=/data/made/synced bs=64k count=4 conv=fsync status=none
    sleep 0.4
    rm -r /data/made
    sleep 0.3
done
"""
BAD_WORDS = ("cannot be repaired", "e2fsck -y", "memory instead of the data partition")


def recording(machine: Machine) -> dict[str, Any] | None:
    """The status, once some seconds are recorded."""
    status = machine.status()
    return status if status.get("recorded_cycles", 0) > 2000 else None


def check(machine: Machine) -> None:
    """Every recording that is finished is read, whole: each chunk's CRC, each cycle number."""
    machine.run(
        "sudo find /data/record -name '*.mcap' -print0 | sudo xargs -0 ecdaq log check", 900
    )


def cycles_kept(machine: Machine, status: dict[str, Any]) -> int:
    """How many cycles of the run in `status` are in the recordings."""
    # ecdaq-TIME-SESSION-SEQUENCE.mcap
    session = Path(status["recording"]).name.split("-")[2]
    rows = json.loads(machine.run("sudo ecdaq log list --dir /data/record --json", seconds=900))
    found = [row for row in rows if row["file"].split("-")[2] == session]
    assert found, (session, rows)
    return sum(int(row["cycles"]) for row in found)


def test_the_machine_comes_back_after_every_cut(machine: Machine) -> None:
    dice = random.Random(SEED)
    table = ["cut  guest s after OP  seen cycles  kept  lost  console"]
    print("\n" + table[0], flush=True)
    for cut in range(1, CUTS + 1):
        wait_for("a recording", OP_S, lambda: recording(machine))
        moment = dice.uniform(0.0, 8.0)
        # The disk is busy, and the last state seen is reported at the end.
        seen = json.loads(
            machine.run(
                "(sudo dd if=/dev/urandom of=/data/noise bs=64k count=64 status=none &)"
                f" ; sleep {moment:.3f}; ecdaq status --json"
            )
        )
        machine.cut_power()
        machine.start(log_writes=cut == CUTS)
        machine.wait_for_login()
        console = machine.console_of_this_boot()
        assert [words for words in BAD_WORDS if words in console] == [], f"cut {cut}"
        assert machine.run("grep -c ' /data ' /proc/mounts").strip() == "1"
        machine.run("sudo test -s /etc/ssh/ssh_host_ed25519_key")
        wait_for("the recorder is at work again", OP_S, lambda: recording(machine))
        check(machine)
        kept = cycles_kept(machine, seen)
        lost = seen["cycles"] - kept
        table.append(f"{cut:3}  {moment:8.3f}  {seen['cycles']:8}  {kept:8}  {lost:6}  clean")
        print(table[-1], flush=True)
        assert lost <= LOSS_LIMIT_CYCLES, table


def follow(machine: Machine) -> list[Acknowledged]:
    """What the recorder says, and how long the log of writes was when it had said so."""
    script = f"sudo sh -c '{NOISE}' & while ecdaq status --json; do sleep 0.2; done"
    said: list[Acknowledged] = []
    with subprocess.Popen(
        ["timeout", str(OP_S), *machine.ssh_command(), script],
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
    ) as ssh:
        assert ssh.stdout is not None
        try:
            for line in ssh.stdout:
                position = machine.write_log.stat().st_size
                got = json.loads(line)["recorder"]
                assert (got["state"], got["cycles_missing"]) == ("running", 0), got
                cycles = got["first_cycle"], got["synced_cycle"]
                said.append(Acknowledged(position, got["session"], *cycles))
                if said[-1].last_cycle - said[0].last_cycle >= LOGGED_CYCLES:
                    machine.cut_power()
                    return said
        finally:
            ssh.terminate()
    raise AssertionError(f"the machine was silent after {said[-1:]}")


def check_the_rest_of_the_disk(machine: Machine, log: WriteLog, source: Source) -> None:
    """Nothing else is written while it records: a cut leaves the boot partition as it is."""
    since = log.count_at(source.acknowledged[0].position)
    end = source.first_sector + source.sectors
    other = [
        entry
        for entry in log.entries[since:]
        if entry.sectors and not source.first_sector <= entry.sector < end
    ]
    assert other == []
    first, sectors = machine.partitions()["boot"]
    copy_sparse(machine.disk, machine.folder / "boot.part", first * SECTOR, sectors * SECTOR)
    machine.tool("fsck.fat", "-n", "boot.part")


def test_every_disk_that_a_cut_may_leave_holds_what_was_acknowledged(
    machine: Machine, monkeypatch: pytest.MonkeyPatch
) -> None:
    wait_for("a recording", OP_S, lambda: recording(machine))
    # It writes the boot state.
    machine.wait_until("the start is good", "systemctl is-active --quiet ecdaq-boot-good")
    said = follow(machine)
    first, sectors = machine.partitions()["data"]
    source = Source(machine.write_log, machine.disk_before, first, sectors, tuple(said))
    log = WriteLog(source.log)
    check_the_rest_of_the_disk(machine, log, source)
    results = examine_all(source, DISKS, SEED)
    flushes = sum(entry.sectors == 0 for entry in log.entries)
    print(
        f"\n{len(said)} times the recorder was asked, from cycle {said[0].last_cycle} to"
        f" {said[-1].last_cycle}; log: {len(log.entries) - flushes} writes, {flushes} flushes"
    )
    print("\n".join(table(results)), flush=True)
    assert sum(result.pending > 0 for result in results) > DISKS // 2
    bad = [result for result in results if is_bad(result)]
    # The same of a disk whose flushes do nothing: the checks see it.
    monkeypatch.setattr(Partition, "settle", lambda _: None)
    for result in examine_all(source, 16, SEED):
        assert is_bad(result) == (result.cut.fate is not Fate.KEPT), result
    assert bad == [], f"{len(bad)} of {len(results)}, seed {SEED}: {bad[:5]}"
