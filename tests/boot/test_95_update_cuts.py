# SPDX-License-Identifier: MIT
"""The power fails during an update and at the first start after it: the machine has a slot that is
whole, and all that is its own. Disks that a cut would have left are made from the log of what the
machine wrote; some of them are booted.

ECDAQ_UPDATE_DISKS: how many disks (200). ECDAQ_UPDATE_BOOTS: how many are booted (2).
ECDAQ_POWER_CUT_SEED.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path

import boot_state
import pytest
from cut_updates import (
    DATA,
    SLOT,
    STATE,
    STATE_FIRST,
    STATE_SECTORS,
    Result,
    Update,
    elsewhere,
    examine_all,
    table,
    whole_disk,
)
from machine import BOOT_S, Machine, profile
from updates import MINUTES, Bundles, own, restart, running, slot_of, stop_bus
from write_log import Fate, Partition

BOOT_FILES = {"ecdaq.yaml": profile("guest"), "hostname": "bench-7\n"}
START = {"log_writes": True}
DISKS = int(os.environ.get("ECDAQ_UPDATE_DISKS", "200"))
BOOTS = int(os.environ.get("ECDAQ_UPDATE_BOOTS", "2"))
SEED = int(os.environ.get("ECDAQ_POWER_CUT_SEED", "1"))
GOOD = "systemctl is-active ecdaq-boot-good"
# In the data partition, where the overlays of /etc and /var are.
KEPT = ("system/etc/machine-id", "system/etc/ssh/ssh_host_ed25519_key.pub")
MINE = "system/var/home/operator/mine"


def good(machine: Machine) -> None:
    machine.wait_for_login()
    machine.wait_until("SSH answers", "true", BOOT_S)
    machine.wait_until("the start is good", GOOD, MINUTES)


def keep(machine: Machine, name: str) -> tuple[Path, Path]:
    """The log and the disk before it, which the next logged start would replace."""
    log, base = (machine.folder / f"{name}.{what}" for what in ("log", "base"))
    machine.write_log.rename(log)
    machine.disk_before.rename(base)
    return log, base


@pytest.fixture(scope="module")
def before(machine: Machine) -> list[str]:
    """What the machine is known by; all of it is on the disk."""
    good(machine)
    machine.wait_until("a recording", "ls /data/record | grep -q ecdaq-")
    machine.run("echo mine > mine")
    stop_bus(machine)
    machine.run("sync")
    return own(machine)


@pytest.fixture(scope="module")
def updates(
    machine: Machine,
    before: list[str],
    image: Path,
    tmp_path_factory: pytest.TempPathFactory,
) -> tuple[Update, Update]:
    """An installation from A to B, and the first start of B."""
    made = Bundles(tmp_path_factory.mktemp("bundles"))
    slot = slot_of(image, machine, made.folder / "slot")
    content = made.add_version("next", slot, "/usr/lib/ecdaq/extra", "new\n", "0.1.1-next")
    places = machine.partitions()
    state = (STATE_FIRST, STATE_SECTORS)
    kept = {name: machine.run(f"sudo cat /data/{name}") for name in (*KEPT, MINE)}
    begin = machine.write_log.stat().st_size
    with made.served():
        machine.run(f"ecdaq-update install {made.url('next')}", MINUTES)
    done = machine.write_log.stat().st_size
    restart(machine)
    log, base = keep(machine, "installation")
    parts = {STATE: state, SLOT: places[SLOT], DATA: places[DATA]}
    install = Update("installation", log, base, parts, content, begin, done, kept)

    machine.start(log_writes=True)
    good(machine)
    stop_bus(machine)
    assert running(machine) == ("B", "A")
    assert own(machine) == before
    machine.run("sync")
    machine.cut_power()
    log, base = keep(machine, "first start")
    parts = {STATE: state, DATA: places[DATA]}
    return install, Update("first start", log, base, parts, content, 0, 0, kept)


@pytest.fixture(scope="module")
def results(updates: tuple[Update, Update]) -> Iterator[list[Result]]:
    found = [r for update in updates for r in examine_all(update, DISKS // 2, SEED)]
    print("\n" + "\n".join(table(found)), flush=True)
    yield found


def test_an_update_writes_the_other_slot_the_boot_state_and_the_data_partition_only(
    updates: tuple[Update, Update],
) -> None:
    for update in updates:
        assert elsewhere(update) == [], update.name


def test_every_disk_that_a_cut_may_leave_starts_a_whole_slot_and_keeps_what_is_the_machines(
    results: list[Result],
) -> None:
    assert {r.slot for r in results if r.update == "installation"} == {"A", "B"}
    assert sum(r.pending > 0 for r in results) > len(results) // 3
    bad = [r for r in results if r.problems]
    assert bad == [], f"{len(bad)} of {len(results)}, seed {SEED}: {bad[:5]}"


def test_a_disk_whose_flushes_do_nothing_is_found(
    updates: tuple[Update, Update], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(Partition, "settle", lambda _: None)
    found = [r for r in examine_all(updates[0], 24, SEED) if r.is_acknowledged]
    dropped = [r for r in found if r.cut.fate is Fate.DROPPED]
    assert dropped and all(r.problems for r in dropped)


def test_such_disks_boot(
    machine: Machine, before: list[str], updates: tuple[Update, Update], results: list[Result]
) -> None:
    """Torn ones with the most that was not flushed, of each kind and slot in turn."""
    torn = [r for r in results if r.cut.fate is Fate.TORN]
    torn.sort(key=lambda r: -r.pending)
    kinds = sorted({(r.update, r.slot) for r in torn}, key=str)
    shares = [[r for r in torn if (r.update, r.slot) == kind] for kind in kinds]
    turns = [share[n] for n in range(len(torn)) for share in shares if n < len(share)]
    for result in turns[:BOOTS]:
        (update,) = (u for u in updates if u.name == result.update)
        machine.stop()
        whole_disk(update, result.cut, SEED, machine.folder, machine.disk)
        slot = boot_state.next_slot(boot_state.read(machine.disk))
        machine.start()
        good(machine)
        stop_bus(machine)
        assert running(machine)[0] == slot, result
        assert own(machine) == before, result
        print(f"booted: {result.update}, cut {result.cut.number}, slot {slot}", flush=True)
