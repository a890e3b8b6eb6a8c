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
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
from machine import TOOLS, TOP

sys.path.insert(0, str(TOP / "tests" / "recipes"))
import firmware

IMAGES = TOP / "build" / "image"
MACHINES = ("qemuarm64", "raspberrypi4-64")
MIB = 1 << 20
SIZES_MIB = {"boot": 128, "rootA": 512, "rootB": 512}
KERNEL = {"qemuarm64": "Image", "raspberrypi4-64": "kernel8.img"}


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
    if built.machine == "qemuarm64":
        assert [p["name"] for p in found] == [*SIZES_MIB, "data"]
    else:
        # The boot ROM takes the first one, if it is FAT.
        assert [p["type"] for p in found] == ["c", "83", "83", "83"]
        assert found[0]["bootable"] is True


def test_the_boot_partition_holds_kernel_command_line_and_settings_folder(built: Built) -> None:
    kernel = built.boot_file(KERNEL[built.machine])
    if kernel[:2] == b"\x1f\x8b":
        kernel = gzip.decompress(kernel)
    assert kernel[56:60] == b"ARMd", "no arm64 kernel"
    assert kernel == built.path("-vmlinux").read_bytes()
    assert (
        built.boot_file("cmdline.txt").decode().strip()
        == built.path(".cmdline").read_text().strip()
    )
    assert b"authorized_keys" in built.boot_file("ecdaq/README.txt")


def test_the_command_line_isolates_the_last_core(built: Built) -> None:
    words = built.path(".cmdline").read_text().split()
    core, others = {"qemuarm64": ("1", "0"), "raspberrypi4-64": ("3", "0-2")}[built.machine]
    for word in (
        *(f"isolcpus=managed_irq,domain,{core}", f"nohz_full={core}", f"rcu_nocbs={core}"),
        *(f"irqaffinity={others}", "ro", "init=/usr/lib/ecdaq/preinit"),
    ):
        assert word in words, words


def test_the_root_is_where_the_command_line_says(built: Built) -> None:
    root = re.findall(r"root=(\S+)", built.path(".cmdline").read_text())
    if built.machine == "qemuarm64":
        assert root == ["PARTLABEL=rootA"]
    else:
        # Disk signature and partition number of the MBR.
        with built.path(".img").open("rb") as file:
            signature = int.from_bytes(file.read(512)[440:444], "little")
        assert root == [f"PARTUUID={signature:08x}-02"]


def test_the_root_file_system_is_clean_and_has_our_programs(built: Built) -> None:
    start = int(built.partitions()[1]["start"]) * 512
    built.tool("e2fsck", "-f", "-n", f"{built.name}.img?offset={start}")
    for program in ("ecdaqd", "ecdaq-record", "ecdaq-dds", "ecdaq"):
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
    if built.machine != "raspberrypi4-64":
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
    for line in ("arm_64bit=1", "kernel=kernel8.img", "enable_uart=1", "upstream_kernel=1"):
        assert line in settings.splitlines()


def test_the_kernel_has_the_drivers_of_the_board(built: Built) -> None:
    config = built.path(".kernel-config").read_text().splitlines()
    for symbol in (
        *("PREEMPT_RT", "BCMGENET", "MMC_SDHCI_IPROC", "BCM2835_WDT", "PINCTRL_BCM2835"),
        *("SERIAL_8250_BCM2835AUX", "RASPBERRYPI_FIRMWARE"),
    ):
        assert f"CONFIG_{symbol}=y" in config, symbol
