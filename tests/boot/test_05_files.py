# SPDX-License-Identifier: MIT
"""Inspects what was built as files: nothing is booted. For the Raspberry Pi this is all that can
be shown without a board; app/doc/how-to/image.md lists what only a board can show."""

from __future__ import annotations

import gzip
import hashlib
import json
import re
import subprocess
import sys
import xml.etree.ElementTree as ET
import zlib
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
from machine import TOOLS, TOP

sys.path.insert(0, str(TOP / "tests" / "recipes"))
import boot_state
import firmware

IMAGES = TOP / "build" / "image"
MACHINES = ("ecdaq-qemuarm64", "ecdaq-raspberrypi4-64")
MIB = 1 << 20
SIZES_MIB = {"boot": 128, "rootA": 512, "rootB": 512}
SLOT = "/usr/lib/ecdaq/slot"


@dataclass(frozen=True)
class Built:
    """The files of one machine's image."""

    machine: str
    folder: Path
    name: str

    def path(self, ending: str) -> Path:
        return self.folder / f"{self.name}{ending}"

    def tool(self, *command: str, check: bool = True) -> bytes:
        """A program of the SDK chroot, in the folder of the image."""
        done = subprocess.run(
            [TOOLS / "qemu.sh", self.folder, *command], capture_output=True, check=check
        )
        return done.stdout

    def partitions(self) -> list[dict[str, Any]]:
        table = json.loads(self.tool("sfdisk", "--json", f"{self.name}.img"))["partitiontable"]
        found: list[dict[str, Any]] = table["partitions"]
        return found

    def boot_file(self, name: str) -> bytes:
        """A file of the boot partition."""
        start = int(self.partitions()[0]["start"]) * 512
        return self.tool("mtype", "-i", f"{self.name}.img@@{start}", f"::{name}")

    def root_file(self, name: str) -> bytes:
        """A file of the root file system."""
        start = int(self.partitions()[1]["start"]) * 512
        where = f"{self.name}.img?offset={start}"
        return self.tool("debugfs", "-R", f"cat {name}", where)

    def link(self, name: str) -> str:
        """Where a symbolic link of the root file system leads."""
        start = int(self.partitions()[1]["start"]) * 512
        where = f"{self.name}.img?offset={start}"
        told = self.tool("debugfs", "-R", f"stat {name}", where).decode()
        found = re.search(r'Fast link dest: "(.*)"', told)
        return found[1] if found else self.root_file(name).decode()


@pytest.fixture(scope="module", params=MACHINES)
def built(request: pytest.FixtureRequest) -> Built:
    folder = IMAGES / request.param
    name = f"ecdaq-image-ecdaq-{request.param}"
    if not (folder / f"{name}.img").exists():
        pytest.skip(f"./build.sh image --machine {request.param} was not run")
    return Built(request.param, folder, name)


def test_every_file_has_the_sum_that_is_stated(built: Built) -> None:
    lines = built.path(".sha256").read_text().splitlines()
    assert len(lines) >= 8
    for line in lines:
        stated, name = line.split()
        with (built.folder / name.lstrip("*")).open("rb") as file:
            assert hashlib.file_digest(file, "sha256").hexdigest() == stated, name


def test_partitions_are_those_of_the_layout(built: Built) -> None:
    found = built.partitions()
    assert [p["size"] * 512 // MIB for p in found] == [*SIZES_MIB.values(), 256]
    assert [p["start"] * 512 % (4 * MIB) for p in found] == [0, 0, 0, 0]
    if built.machine == "ecdaq-qemuarm64":
        assert [p["name"] for p in found] == [*SIZES_MIB, "data"]
    else:
        # The boot ROM takes the first one, if it is FAT.
        assert [p["type"] for p in found] == ["c", "83", "83", "83"]
        assert found[0]["bootable"] is True


def test_the_boot_partition_holds_the_boot_script_and_the_settings_folder(built: Built) -> None:
    script = built.boot_file("boot.scr")
    # U-Boot's image header: magic number, CRC of itself, and kind 6.
    assert script[:4] == b"\x27\x05\x19\x56" and script[30] == 6
    assert zlib.crc32(script[:4] + bytes(4) + script[8:64]) == int.from_bytes(script[4:8], "big")
    source = TOP / "recipes/recipes-bsp/u-boot-ecdaq/files/boot.cmd"
    assert source.read_bytes() in script
    assert b"authorized_keys" in built.boot_file("ecdaq/README.txt")


def test_the_slot_holds_kernel_command_line_and_device_trees(built: Built) -> None:
    kernel = built.root_file(built.link(f"{SLOT}/kernel"))
    assert kernel == built.path("-vmlinux").read_bytes()
    if kernel[:2] == b"\x1f\x8b":
        kernel = gzip.decompress(kernel)
    assert kernel[56:60] == b"ARMd", "no arm64 kernel"
    words = built.path(".cmdline").read_text()
    assert built.root_file(f"{SLOT}/slot.env").decode() == f"cmdline={words}"
    if built.machine == "ecdaq-raspberrypi4-64":
        for tree in (*firmware.TREES, "bcm2711-rpi-cm4.dtb"):
            link = built.link(f"{SLOT}/dtb/broadcom/{tree}")
            assert built.root_file(link)[:4] == b"\xd0\x0d\xfe\xed", tree


def test_the_boot_state_is_in_front_of_the_first_partition(built: Built) -> None:
    first = min(int(p["start"]) for p in built.partitions()) * 512
    ends = [offset + size for offset, size in boot_state.PLACES]
    # A GPT ends before 1 MiB.
    assert boot_state.PLACES[0][0] >= MIB and ends[0] <= boot_state.PLACES[1][0]
    assert ends[1] <= first
    assert boot_state.read(built.path(".img")) == [None, None], "a new disk has none"
    assert built.root_file("/etc/fw_env.config") == boot_state.CONFIG.read_bytes()


def test_the_firmware_of_the_emulator_is_u_boot_of_the_image(built: Built) -> None:
    board = {"ecdaq-qemuarm64": "qemu_arm64", "ecdaq-raspberrypi4-64": "rpi_arm64"}[built.machine]
    loader = built.root_file(f"/usr/lib/u-boot-ecdaq/{board}/u-boot.bin")
    assert loader == built.path("-u-boot.bin").read_bytes()
    assert b"-ecdaq (" in loader
    if built.machine == "ecdaq-raspberrypi4-64":
        assert built.boot_file("u-boot.bin") == loader


def test_the_command_line_isolates_the_last_core(built: Built) -> None:
    words = built.path(".cmdline").read_text().split()
    cores = {"ecdaq-qemuarm64": ("1", "0"), "ecdaq-raspberrypi4-64": ("3", "0-2")}
    core, others = cores[built.machine]
    for word in (
        *(f"isolcpus=managed_irq,domain,{core}", f"nohz_full={core}", f"rcu_nocbs={core}"),
        *(f"irqaffinity={others}", "ro", "init=/usr/lib/ecdaq/preinit"),
    ):
        assert word in words, words
    # The boot script adds these: they are those of the slot.
    assert [w for w in words if w.startswith(("root=", "rauc.slot="))] == []


def test_the_root_file_system_is_clean_and_has_our_programs(built: Built) -> None:
    start = int(built.partitions()[1]["start"]) * 512
    built.tool("e2fsck", "-f", "-n", f"{built.name}.img?offset={start}")
    services = ("ecdaqd", "ecdaq-record", "ecdaq-dds", "ecdaq-web", "ecdaq-stream", "ecdaq-uplink")
    for program in (*services, "ecdaq-web-command", "ecdaq"):
        head = built.root_file(f"/usr/bin/{program}")[:20]
        # 64 bits, little-endian, for AArch64.
        assert head[:6] == b"\x7fELF\x02\x01" and head[18:20] == b"\xb7\x00", program


def test_the_image_says_what_it_is(built: Built) -> None:
    release = built.root_file("/usr/lib/os-release").decode()
    text = built.root_file("/usr/lib/ecdaq/image").decode()
    said = re.fullmatch(r"(\S+) (\S+), Debian archive: (\S+)\n", text)
    assert said, text
    name, version, archive = said.groups()
    assert name == f"ecdaq-image-{built.machine}"
    assert re.fullmatch(r"[0-9.]+-([0-9a-f]{7,40}(-dirty)?|unknown)", version)
    # A cache from before the state of the archive was noted does not know it.
    assert re.fullmatch(r"\d{4}-\d\d-\d\d|unknown", archive)
    assert f"\nIMAGE_ID={name}\nIMAGE_VERSION={version}\n" in release
    assert f"\nECDAQ_ARCHIVE_DATE={archive}\n" in release


def test_services_are_switched_on_in_the_slot(built: Built) -> None:
    """A slot that comes by an update has no first start, at which systemd would do it."""
    start = int(built.partitions()[1]["start"]) * 512
    where = f"{built.name}.img?offset={start}"
    wants = "/etc/systemd/system/multi-user.target.wants"
    listing = built.tool("debugfs", "-R", f"ls -p {wants}", where).decode()
    for unit in ("systemd-networkd", "ssh", "chrony", "ecdaqd", "ecdaq-boot-good"):
        assert f"/{unit}.service/" in listing, unit
    assert "systemd-timesyncd" not in listing


def test_updates_are_taken_of_the_keyring(built: Built) -> None:
    found = built.root_file("/usr/lib/rauc/system.conf").decode()
    assert f"\ncompatible={built.machine}\n" in found
    assert b"BEGIN CERTIFICATE" in built.root_file("/usr/lib/rauc/keyring.pem")


def test_the_data_partition_is_made_for_large_files(built: Built) -> None:
    start = int(built.partitions()[3]["start"]) * 512
    where = f"{built.name}.img?offset={start}"
    head = built.tool("debugfs", "-R", "stats -h", where).decode()
    assert re.search(r"^Block size: +4096$", head, re.M)
    assert re.search(r"^Inodes per group: +2048$", head, re.M)


def test_nothing_secret_and_nothing_of_one_machine_is_in_it(built: Built) -> None:
    shadow = built.root_file("/etc/shadow").decode().splitlines()
    assert len(shadow) > 10
    assert [line for line in shadow if line.split(":")[1][:1] not in ("!", "*")] == []
    listing = built.tool(
        "debugfs", "-R", "ls -p /etc/ssh",
        f"{built.name}.img?offset={int(built.partitions()[1]['start']) * 512}",
    ).decode()  # fmt: skip
    assert "sshd_config" in listing
    assert "ssh_host" not in listing
    assert built.root_file("/etc/machine-id").strip() in (b"", b"uninitialized")


def test_the_bill_of_materials_names_every_package_with_its_source(built: Built) -> None:
    bill = json.loads(built.path(".spdx.json").read_text())
    assert bill["spdxVersion"] == "SPDX-2.3"
    named = {(p["name"], p["versionInfo"]) for p in bill["packages"] if "versionInfo" in p}
    manifest = [line.split() for line in built.path(".manifest").read_text().splitlines()]
    installed = {(row[0].partition(":")[0], row[1]) for row in manifest if row[0][0] != "#"}
    assert len(installed) > 100
    assert {name for name, _ in installed} <= {name for name, _ in named}
    assert {"ecdaq", "ecdaq-config", "linux-image-ecdaq"} <= {name for name, _ in installed}
    assert all(p["licenseDeclared"] for p in bill["packages"])
    # What a CVE is looked up by: the kernel's own version, and what is compiled into programs.
    config = built.path(".kernel-config").read_text()
    kernel = re.findall(r"^# Linux/arm64 (\S+) Kernel", config, re.M)[0]
    assert [v for n, v in named if n == "linux" and v.startswith(f"{kernel}-")]
    assert "soem" in {name for name, _ in named}


def test_the_block_map_covers_what_is_written(built: Built) -> None:
    root = ET.parse(built.path(".bmap")).getroot()
    size = int((root.findtext("ImageSize") or "0").strip())
    assert size == built.path(".img").stat().st_size
    mapped = int((root.findtext("MappedBlocksCount") or "0").strip())
    blocks = int((root.findtext("BlocksCount") or "0").strip())
    print(f"\n{built.machine}: {size >> 20} MiB, {mapped * 4096 >> 20} MiB of it written, ", end="")
    print(f"{built.path('.img.zst').stat().st_size >> 20} MiB packed")
    assert 0 < mapped < blocks / 2


def test_the_firmware_of_the_board_finds_what_it_needs(built: Built) -> None:
    if built.machine != "ecdaq-raspberrypi4-64":
        pytest.skip("QEMU's machine has no firmware")
    settings = built.boot_file("config.txt").decode()
    files = {name: built.boot_file(name) for name in sorted(firmware.files_wanted(settings))}
    assert [name for name, content in files.items() if not content] == []
    assert files["start4.elf"][:4] == b"\x7fELF"
    assert firmware.unknown_keys(settings, files["start4.elf"]) == []
    for tree in firmware.TREES:
        assert files[tree][:4] == b"\xd0\x0d\xfe\xed", "no device tree"
        assert b"brcm,bcm2711" in files[tree]
        for needed in (b"brcm,bcm2711-genet-v5", b"brcm,bcm2711-emmc2", b"brcm,bcm2835-pm"):
            assert needed in files[tree], (tree, needed)
    for line in ("arm_64bit=1", "kernel=u-boot.bin", "enable_uart=1", "upstream_kernel=1"):
        assert line in settings.splitlines()


def test_the_kernel_has_the_drivers_of_the_board(built: Built) -> None:
    config = built.path(".kernel-config").read_text().splitlines()
    for symbol in (
        *("PREEMPT_RT", "BCMGENET", "MMC_SDHCI_IPROC", "BCM2835_WDT", "PINCTRL_BCM2835"),
        *("SERIAL_8250_BCM2835AUX", "RASPBERRYPI_FIRMWARE"),
    ):
        assert f"CONFIG_{symbol}=y" in config, symbol
