# SPDX-License-Identifier: MIT
"""U-Boot takes the slot that the boot state names, counts the try before it uses the slot, and
always finds a state that is whole."""

from __future__ import annotations

import re
from random import Random

import boot_state
import pytest
from boot_state import Copy, slots
from machine import Machine, wait_for
from write_log import SECTOR, copy_sparse

SEED = 1
EMPTY = bytes(boot_state.PLACES[0][1])
# Guest time: U-Boot needs some seconds of the host's.
START_S = 600
SLOT = "/usr/lib/ecdaq/slot"
# Header of an arm64 kernel of 64 KiB at any place, without code but "wfi; b .-4".
HANGING_KERNEL = (
    b"\x10\x00\x00\x14" + bytes(4)  # branch to the code at 64
    + (0).to_bytes(8, "little") + (1 << 16).to_bytes(8, "little") + (0b1010).to_bytes(8, "little")
    + bytes(24) + b"ARMd" + bytes(4)
    + b"\x7f\x20\x03\xd5\xff\xff\xff\x17"
)  # fmt: skip


def start_until(machine: Machine, pattern: str, *options: str) -> str:
    """Power on, and off again as soon as the console shows `pattern`."""
    machine.start(options=tuple(options))
    found = machine.wait_for_console(pattern, START_S)
    machine.stop()
    return found


def chosen(machine: Machine) -> str:
    """Slot and tries left of the next start."""
    found = start_until(machine, r"ecdaq: slot \w, tries left: \w+\b")
    return found.removeprefix("ecdaq: slot ").replace(", tries left:", "")


def root_partition(machine: Machine) -> str:
    return f"disk.img?offset={machine.partitions()['rootA'][0] * 512}"


def fill_slot_b(machine: Machine) -> None:
    """Slot B becomes what slot A is."""
    (first, sectors), (other, _) = (machine.partitions()[name] for name in ("rootA", "rootB"))
    copy_sparse(machine.disk, machine.folder / "slot", first * SECTOR, sectors * SECTOR)
    machine.tool("dd", "if=slot", "of=disk.img", f"seek={other}", "conv=notrunc,sparse")
    (machine.folder / "slot").unlink()


def test_the_kernel_and_its_root_are_those_of_the_slot(machine: Machine) -> None:
    words = machine.run("cat /proc/cmdline").split()
    assert "rauc.slot=A" in words
    root = next(w for w in words if w.startswith("root=PARTUUID=")).removeprefix("root=PARTUUID=")
    label = machine.run(f"lsblk --noheadings --output PARTLABEL /dev/disk/by-partuuid/{root}")
    assert label.strip() == "rootA"
    told = machine.run(f"cat {SLOT}/slot.env").removeprefix("cmdline=").split()
    assert words[: len(told)] == told


def test_a_start_that_was_good_gives_the_slot_its_tries_again(machine: Machine) -> None:
    assert "ecdaq: slot A, tries left: 2" in machine.console()
    machine.wait_until("the start is good", "systemctl is-active ecdaq-boot-good")
    assert machine.run("sudo fw_printenv -n BOOT_A_LEFT").strip() == "3"


def test_what_linux_writes_is_what_the_next_start_takes(machine: Machine) -> None:
    machine.run("sudo fw_setenv BOOT_A_LEFT 2")
    machine.run("sudo fw_setenv BOOT_B_LEFT 1")
    machine.cut_power()
    assert chosen(machine) == "A 1"
    latest = boot_state.latest(boot_state.read(machine.disk))
    assert latest is not None
    assert latest.values == slots("A B", 1, 1)


def test_a_slot_without_a_kernel_is_left_at_once(machine: Machine) -> None:
    boot_state.write(machine.disk, [Copy(1, slots("B A", 3, 3)).pack(), EMPTY])
    start_until(machine, r"ecdaq: slot A, tries left: 2")
    console = machine.console_of_this_boot()
    assert re.search(r"slot B, tries left: 2\s[\s\S]*slot B cannot be started", console)
    fill_slot_b(machine)
    machine.start()
    machine.wait_for_console(r"Kernel command line: .* rauc\.slot=B\b", START_S)
    machine.stop()


@pytest.mark.parametrize(
    ("copies", "wanted", "written"),
    [
        ((None, None), "A 2", (0, 1)),
        ((Copy(5, slots("A B", 3, 3)), Copy(6, slots("A B", 2, 3))), "A 1", (0, 7)),
        ((Copy(7, slots("A B", 2, 3)), Copy(6, slots("A B", 3, 3))), "A 1", (1, 8)),
        ((Copy(9, slots("B A", 3, 2)), None), "B 1", (1, 10)),
        ((None, Copy(9, slots("B A", 3, 2))), "B 1", (0, 10)),
        ((Copy(255, slots("A B", 3, 3)), Copy(0, slots("A B", 2, 3))), "A 1", (0, 1)),
        ((Copy(0, slots("A B", 2, 3)), Copy(255, slots("A B", 3, 3))), "A 1", (1, 1)),
        ((Copy(254, slots("A B", 3, 3)), Copy(255, slots("A B", 2, 3))), "A 1", (0, 0)),
        ((Copy(1, slots("A B", 0, 2)), None), "B 1", (1, 2)),
    ],
    ids=[
        *("new disk", "second is later", "first is later", "only the first", "only the second"),
        *("counter overflowed", "counter overflowed in the second", "counter overflows now"),
        *("no try left for the first slot",),
    ],
)
def test_the_later_good_copy_counts_and_the_other_one_is_written(
    machine: Machine,
    copies: tuple[Copy | None, Copy | None],
    wanted: str,
    written: tuple[int, int],
) -> None:
    boot_state.write(machine.disk, [c.pack() if c else EMPTY for c in copies])
    slot, left = wanted.split()
    assert boot_state.next_slot(boot_state.read(machine.disk)) == slot
    assert chosen(machine) == wanted
    place, counter = written
    after = boot_state.read(machine.disk)
    assert after[1 - place] == copies[1 - place], "the copy that was valid is untouched"
    assert after[place] is not None
    assert after[place].counter == counter
    assert after[place].values[f"BOOT_{slot}_LEFT"] == left


def test_a_write_that_was_cut_off_leaves_the_state_before_it(machine: Machine) -> None:
    before, after = Copy(20, slots("A B", 2, 3)).pack(), Copy(21, slots("A B", 0, 3)).pack()
    older = Copy(19, slots("B A", 3, 3)).pack()
    # Where the last value of the new copy is complete.
    length = len(after.rstrip(b"\0"))
    dice = Random(SEED)
    for _ in range(3):
        cut = dice.randrange(1, length - 2)
        rest = older[cut:] if dice.random() < 0.5 else dice.randbytes(len(older) - cut)
        boot_state.write(machine.disk, [before, after[:cut] + rest])
        assert chosen(machine) == "A 1", cut


def test_without_a_slot_left_each_gets_its_tries_again(machine: Machine) -> None:
    boot_state.write(machine.disk, [Copy(1, slots("A B", 0, 0)).pack(), EMPTY])
    machine.start()
    process = machine.process
    assert process is not None
    wait_for("the reset", START_S, lambda: process.poll() is not None)
    machine.stop()
    assert "no slot is left" in machine.console_of_this_boot()
    found = boot_state.read(machine.disk)[1]
    assert found is not None
    assert found.values == slots("A B", 3, 3)


def test_words_of_the_boot_partition_reach_the_kernel(machine: Machine) -> None:
    boot_state.write(machine.disk, [EMPTY, EMPTY])
    machine.start(append="ecdaq.test=1 ecdaq.other=2")
    machine.wait_for_console(r"Kernel command line: .* ecdaq\.test=1 ecdaq\.other=2\b", START_S)
    machine.stop()


def test_a_kernel_that_hangs_is_reset_by_the_watchdog(machine: Machine) -> None:
    """Last, as it replaces the slot's kernel. The guest's clock jumps over the waiting."""
    boot_state.write(machine.disk, [Copy(1, slots("A", 2, 0)).pack(), EMPTY])
    (machine.folder / "kernel").write_bytes(HANGING_KERNEL.ljust(1 << 16, b"\0"))
    for command in (f"rm {SLOT}/kernel", f"write kernel {SLOT}/kernel"):
        machine.tool("debugfs", "-w", "-R", command, root_partition(machine))
    machine.start(options=("-device", "i6300esb"))
    process = machine.process
    assert process is not None
    machine.wait_for_console(r"Starting kernel", START_S)
    wait_for("the watchdog's reset", START_S, lambda: process.poll() is not None)
    assert process.returncode == 0
    machine.stop()
    assert chosen(machine) == "A 0"
