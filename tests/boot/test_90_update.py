# SPDX-License-Identifier: MIT
"""A machine in the field: updated from slot A to B and back, with what is its own kept. Bundles
that are not for it are refused; one that does not start well is left by itself."""

from __future__ import annotations

import os
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest
from machine import BOOT_S, TOOLS, Machine, profile, wait_for
from updates import (
    MINUTES,
    NEXT,
    Bundles,
    own,
    restart,
    running,
    slot_of,
    start,
    state,
    stop_bus,
    until_off,
)

BOOT_FILES = {"ecdaq.yaml": profile("guest"), "hostname": "bench-7\n"}
NOBODY = "[Service]\nExecStart=\nExecStart=/usr/bin/sleep infinity\n"


@pytest.fixture(scope="module")
def bundles(
    image: Path, machine: Machine, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[Bundles]:
    """Made while the machine starts."""
    found = Bundles(tmp_path_factory.mktemp("bundles"))
    slot = slot_of(image, machine, found.folder / "slot")

    def variant(name: str, path: str, text: str, version: str = "0.1.1-next") -> None:
        found.add_version(name, slot, path, text, version).unlink()

    variant("next", "/usr/lib/ecdaq/extra", "new\n")
    variant("stick", "/usr/lib/ecdaq/extra", "stick\n", "0.1.2-stick")
    variant("panics", "/usr/lib/ecdaq/slot/slot.env", "cmdline=console=ttyAMA0 panic=5 init=/no\n")
    variant("sick", "/usr/lib/systemd/system/ecdaqd.service.d/sick.conf", NOBODY)
    slot.unlink()
    small = found.folder / "small"
    (found.folder / "small.d").mkdir()
    (found.folder / "small.d/x").write_bytes(os.urandom(100_000))
    small.write_bytes(b"")
    os.truncate(small, 8 << 20)
    found_tool = [TOOLS / "qemu.sh", found.folder, "mke2fs", "-q", "-d", "small.d", small.name]
    subprocess.run(found_tool, check=True)
    subprocess.run(
        [
            *("openssl", "req", "-x509", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:P-256"),
            *("-nodes", "-days", "10", "-subj", "/CN=stranger", "-keyout", "other.key"),
            *("-out", "other.pem"),
        ],
        cwd=found.folder,
        check=True,
        capture_output=True,
    )
    own = {"ECDAQ_BUNDLE_MACHINE": "ecdaq-qemuarm64", "ECDAQ_BUNDLE_VERSION": "9.0.0"}
    found.make("stranger", small, "other.key", "other.pem", **own)
    found.make("foreign", small, **(own | {"ECDAQ_BUNDLE_MACHINE": "ecdaq-raspberrypi4-64"}))
    found.make("old", small, **(own | {"ECDAQ_BUNDLE_VERSION": "0.0.9"}))
    whole = (found.folder / "next.raucb").read_bytes()
    (found.folder / "cut.raucb").write_bytes(whole[: len(whole) // 2])
    with found.served():
        yield found


@pytest.fixture(scope="module")
def before(machine: Machine) -> list[str]:
    machine.wait_until("the start is good", "systemctl is-active ecdaq-boot-good", MINUTES)
    machine.run("echo mine > mine; sudo touch /etc/ssh/mine")
    machine.wait_until("a recording", "ls /data/record | grep -q ecdaq-")
    stop_bus(machine)
    found = own(machine)
    assert found[0] == "bench-7" and len(found) >= 5
    return found


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("stranger", "not of a key that this machine knows"),
        ("cut", "cut off, damaged or no bundle"),
        ("foreign", "it is for another machine"),
        ("old", "it is older than what runs, --allow-downgrade"),
    ],
)
def test_a_bundle_that_is_not_for_it_is_refused_in_one_line(
    machine: Machine, before: list[str], bundles: Bundles, name: str, said: str
) -> None:
    was = state(machine)
    done = machine.try_run(f"ecdaq-update install {bundles.url(name)} 2>&1", MINUTES)
    print(done.stdout)
    assert done.returncode == 1
    assert said in done.stdout
    assert done.stdout.count("\n") == 1
    assert state(machine) == was
    assert "slot B: empty" in machine.run("ecdaq-update status")
    assert machine.try_run("sudo ls /data/rauc/trial").returncode != 0


def test_a_service_cannot_change_the_slots(machine: Machine, before: list[str]) -> None:
    was = state(machine)
    done = machine.run("sudo -u ecdaq-dds rauc status mark-active other 2>&1; echo $?")
    assert not done.endswith("\n0\n"), done
    assert state(machine) == was


def test_an_update_keeps_what_is_the_machines(
    machine: Machine, before: list[str], bundles: Bundles
) -> None:
    done = machine.run(f"ecdaq-update install {bundles.url('next')}", MINUTES)
    print(done)
    assert "installed in slot B: ecdaq-image-ecdaq-qemuarm64 0.1.1-next" in done
    assert "starts next" in machine.run("ecdaq-update status").splitlines()[1]
    restart(machine)
    start(machine, "B")
    assert machine.run("cat /usr/lib/ecdaq/image") == NEXT
    assert own(machine) == before
    # The rest of /etc is that of the slot.
    assert machine.try_run("ls /etc/ssh/mine").returncode != 0
    assert machine.try_run("sudo ls /data/rauc/trial").returncode != 0
    assert state(machine) == {"BOOT_ORDER": "B A", "BOOT_A_LEFT": "3", "BOOT_B_LEFT": "3"}
    doctor = {x["name"]: x for x in machine.json("ecdaq doctor --json || true")["check"]}
    assert doctor["slots"]["value"].startswith("B runs, A: 0.1.0-")
    assert machine.run("systemctl --failed --no-legend --plain").strip() == ""


def test_the_way_back_is_a_switch(machine: Machine, before: list[str]) -> None:
    slot, other = running(machine)
    said = machine.run("ecdaq-update switch")
    assert said.startswith(f"slot {other} starts with the next start: ecdaq-image-")
    restart(machine)
    start(machine, other)
    assert own(machine) == before
    assert state(machine)["BOOT_ORDER"] == f"{other} {slot}"
    # And forward again, for what follows.
    machine.run("ecdaq-update switch")
    restart(machine)
    start(machine, slot)


def test_a_kernel_that_panics_is_left_after_three_tries(
    machine: Machine, before: list[str], bundles: Bundles
) -> None:
    slot, other = running(machine)
    machine.run(f"ecdaq-update install {bundles.url('panics')}", MINUTES)
    restart(machine)
    times = []
    for _ in range(3):
        machine.start()
        times.append(until_off(machine))
        assert "Kernel panic" in machine.console_of_this_boot()
        assert f"ecdaq: slot {other}" in machine.console_of_this_boot()
    print(f"panics: reset {times} s after the start of the kernel, guest time")
    start(machine, slot)
    assert own(machine) == before
    assert state(machine)[f"BOOT_{other}_LEFT"] == "0"


def test_a_slot_whose_master_never_gets_ready_is_left_at_once(
    machine: Machine, before: list[str], bundles: Bundles
) -> None:
    slot, other = running(machine)
    machine.run(f"ecdaq-update install {bundles.url('sick')}", MINUTES)
    restart(machine)
    machine.start()
    seconds = until_off(machine, MINUTES)
    assert f"ecdaq: slot {other}" in machine.console_of_this_boot()
    print(f"ecdaqd never ready: reset {seconds} s after the start of the kernel, guest time")
    assert 300 <= seconds < 400
    start(machine, slot)
    assert own(machine) == before


def media(machine: Machine) -> list[str]:
    """What became of the bundles on disks, in this start."""
    command = "sudo journalctl --boot --output=cat --unit ecdaq-update-media"
    lines = machine.run(command).splitlines()
    word = "ecdaq-update-media: "
    return [line.removeprefix(word) for line in lines if line.startswith(word)]


def usb_disk(machine: Machine, bundles: Bundles, *names: str) -> tuple[str, ...]:
    """QEMU's options for a USB disk with these bundles, one FAT file system without partitions."""
    disk = machine.folder / "stick.img"
    disk.write_bytes(b"")
    os.truncate(disk, 512 << 20)
    machine.tool("mkfs.vfat", disk.name)
    for name in names:
        os.link(bundles.folder / f"{name}.raucb", machine.folder / f"{name}.raucb")
        machine.tool("mcopy", "-i", disk.name, f"{name}.raucb", "::")
    return (
        *("-drive", f"if=none,id=stick,format=raw,file={disk.name}", "-device", "qemu-xhci,id=usb"),
        *("-device", "usb-storage,bus=usb.0,drive=stick"),
    )


def test_bundles_on_a_usb_disk_are_installed_once(
    machine: Machine, before: list[str], bundles: Bundles
) -> None:
    """One is not signed for this machine, one may be installed; nobody touches the machine."""
    slot, other = running(machine)
    options = usb_disk(machine, bundles, "stranger", "stick")
    restart(machine, "sudo systemctl --no-block poweroff")
    machine.start(options=options)
    until_off(machine, MINUTES)
    said = machine.console_of_this_boot()
    assert (
        f"stick.raucb: installed in slot {other}: ecdaq-image-ecdaq-qemuarm64 0.1.2-stick" in said
    )
    assert "restart into it" in said
    machine.start(options=options)
    machine.wait_until("SSH answers", "true", BOOT_S)
    machine.wait_until("the start is good", "systemctl is-active ecdaq-boot-good", MINUTES)
    stop_bus(machine)
    assert running(machine) == (other, slot)
    assert own(machine) == before
    found = wait_for("both bundles are looked at", MINUTES, lambda: len(media(machine)) >= 2)
    assert found
    lines = media(machine)
    assert "stick.raucb: 0.1.2-stick runs already" in lines
    (line,) = (x for x in lines if x.startswith("stranger.raucb: "))
    assert "not of a key that this machine knows" in line
    # Back in the old slot the new one is not installed again.
    machine.run("ecdaq-update switch")
    restart(machine)
    machine.start(options=options)
    machine.wait_until("SSH answers", "true", BOOT_S)
    machine.wait_until("the start is good", "systemctl is-active ecdaq-boot-good", MINUTES)
    stop_bus(machine)
    assert running(machine) == (slot, other)
    wait_for("both bundles are looked at", MINUTES, lambda: len(media(machine)) >= 2)
    assert any(
        x.startswith("stick.raucb: left alone, as before: installed") for x in media(machine)
    )


def test_a_factory_reset_and_a_serial_login_need_a_file(
    machine: Machine, before: list[str]
) -> None:
    restart(machine, "sudo systemctl --no-block poweroff")
    assert "operator@bench-7" not in machine.console()
    machine.write_boot_files({"factory-reset": "\n", "serial-login": "\n"})
    machine.start()
    machine.wait_for_console(r"operator@bench-7")
    machine.wait_until("SSH answers", "true", BOOT_S)
    assert machine.try_run("ls mine").returncode != 0
    now = machine.run("cat /etc/machine-id /etc/ssh/ssh_host_ed25519_key.pub").splitlines()
    assert set(now) & set(before) == set()
    assert machine.run("hostname").strip() == "bench-7"
    assert machine.try_run("ls /boot/ecdaq/factory-reset").returncode != 0
