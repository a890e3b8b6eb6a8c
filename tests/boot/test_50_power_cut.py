# SPDX-License-Identifier: MIT
"""The power fails at random moments: the machine boots again, its file system is repaired by
its journal alone, and the recordings open.

In guest time, so that the moments are spread over the guest's second and not over the host's load.
ECDAQ_POWER_CUTS: how many (1). ECDAQ_POWER_CUT_SEED.
"""

from __future__ import annotations

import json
import os
import random
from pathlib import Path
from typing import Any

from machine import Machine, profile, wait_for

BOOT_FILES = {"ecdaq.yaml": profile("guest")}
CUTS = int(os.environ.get("ECDAQ_POWER_CUTS", "1"))
SEED = int(os.environ.get("ECDAQ_POWER_CUT_SEED", "1"))
OP_S = 900
# What a cut may cost at most: one record.sync_period (1 s) and one record.chunk_period (100 ms),
# and the time the disk takes.
LOSS_LIMIT_CYCLES = 2000
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
    run = Path(status["recording"]).name.rpartition("-")[0]
    rows = json.loads(machine.run("sudo ecdaq log list --dir /data/record --json", seconds=900))
    found = [row for row in rows if row["file"].startswith(run)]
    assert found, (run, rows)
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
        machine.start()
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
