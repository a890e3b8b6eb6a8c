# SPDX-License-Identifier: MIT
"""The power goes at random moments: the machine boots again by itself, its file system is
mended by its journal alone, and the recordings open."""

from __future__ import annotations

import os
import random

from machine import Machine, wait_for

CUTS = int(os.environ.get("ECDAQ_POWER_CUTS", "3"))
SEED = int(os.environ.get("ECDAQ_POWER_CUT_SEED", "1"))


def test_the_machine_comes_back_after_every_cut(machine: Machine) -> None:
    dice = random.Random(SEED)
    machine.run("sudo sync")
    for cut in range(CUTS):
        wait_for("a recording", 180, lambda: machine.try_run("sudo ls /data/record/*").stdout)
        moment = dice.uniform(0.0, 15.0)
        machine.try_run(
            f"sudo dd if=/dev/urandom of=/data/noise bs=64k count=64 & sleep {moment:.1f}"
        )
        machine.cut_power()
        machine.start()
        machine.wait_for_login()
        console = machine.console_of_this_boot()
        assert "cannot be mended" not in console, f"cut {cut}"
        assert "e2fsck -y" not in console, f"cut {cut}"
        assert "memory instead of the data partition" not in console, f"cut {cut}"
        assert machine.run("mount | grep -c ' /data '").strip() == "1"
        machine.run("sudo test -s /etc/ssh/ssh_host_ed25519_key")
        # The recorder mends what the cut left open; then every file is whole, up to its last sync.
        wait_for("a finished recording", 120, lambda: finished(machine))
        machine.run("sudo find /data/record -name '*.mcap' -print0 | sudo xargs -0 ecdaq log check")


def finished(machine: Machine) -> str:
    return machine.try_run("sudo find /data/record -name '*.mcap' -size +1k").stdout
