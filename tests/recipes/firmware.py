# SPDX-License-Identifier: MIT
"""What the firmware of a Raspberry Pi 4 looks for on the boot partition, as Raspberry Pi's
documentation of config.txt and its firmware's issue threads have it. Conditions ([cm4], ...) are
not followed: what any board needs has to be there."""

from __future__ import annotations

import re

# One for each board that the image is for, under mainline's names (upstream_kernel=1).
TREES = ("bcm2711-rpi-4-b.dtb", "bcm2711-rpi-400.dtb", "bcm2711-rpi-cm4-io.dtb")
# Less memory than this for the graphics processor: the cut-down firmware is taken.
CUT_DOWN_BELOW_MIB = 32
# Read by the EEPROM's boot loader, not by start4.elf.
OF_BOOT_LOADER = {"gpu_mem"}


def settings(text: str) -> list[tuple[str, str]]:
    """Key and value of each line that sets something."""
    lines = (line.partition("#")[0].strip() for line in text.splitlines())
    pairs = (line.partition("=") for line in lines if "=" in line)
    return [(key.strip(), value.strip()) for key, _, value in pairs]


def files_wanted(text: str) -> set[str]:
    """Every file that the firmware opens with this config.txt, and cannot do without."""
    wanted = {"start4.elf", "fixup4.dat", "config.txt", *TREES}
    for key, value in settings(text):
        if key.startswith("gpu_mem") and int(value) < CUT_DOWN_BELOW_MIB:
            wanted |= {"start4cd.elf", "fixup4cd.dat"}
        elif key == "start_x" and value == "1":
            wanted |= {"start4x.elf", "fixup4x.dat"}
        elif key == "dtoverlay" and value:
            wanted.add(f"overlays/{value.partition(',')[0]}.dtbo")
        elif key in ("kernel", "device_tree", "start_file", "fixup_file"):
            wanted.add(value)
        elif key in ("initramfs", "ramfsfile"):
            wanted.add(value.split()[0])
    return wanted


def missing(text: str, present: set[str]) -> list[str]:
    """What config.txt makes the firmware look for, and is not there."""
    return sorted(files_wanted(text) - present)


def unknown_keys(text: str, firmware: bytes) -> list[str]:
    """Keys that this firmware is too old, or too new, to know: their names are not in it."""
    words = set(re.findall(rb"[A-Za-z0-9_]+", firmware))
    keys = {key for key, _ in settings(text)} - OF_BOOT_LOADER
    return sorted(key for key in keys if key.encode() not in words)
