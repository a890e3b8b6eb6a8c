# SPDX-License-Identifier: MIT
"""The boot state as it is on the disk: two copies in the format of U-Boot's redundant
environment."""

from __future__ import annotations

import re
import struct
import zlib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

TOP = Path(__file__).resolve().parents[2]
CONFIG = TOP / "recipes/recipes-core/ecdaq-config/files/root/etc/fw_env.config"
HEAD = struct.Struct("<IB")


def places(text: str) -> list[tuple[int, int]]:
    """Offset and size of each copy that a fw_env.config names."""
    lines = re.findall(r"^/\S+\s+(0x[0-9a-f]+)\s+(0x[0-9a-f]+)$", text, re.MULTILINE)
    return [(int(offset, 16), int(size, 16)) for offset, size in lines]


PLACES = places(CONFIG.read_text())


@dataclass(frozen=True)
class Copy:
    """One valid copy."""

    counter: int
    values: dict[str, str]

    def pack(self) -> bytes:
        text = "".join(f"{name}={value}\0" for name, value in self.values.items()) + "\0"
        data = text.encode().ljust(PLACES[0][1] - HEAD.size, b"\0")
        return HEAD.pack(zlib.crc32(data), self.counter) + data


def unpack(raw: bytes) -> Copy | None:
    """The copy in `raw`; None if its CRC is wrong."""
    crc, counter = HEAD.unpack_from(raw)
    data = raw[HEAD.size :]
    if zlib.crc32(data) != crc:
        return None
    pairs = (line.partition("=") for line in data.partition(b"\0\0")[0].decode().split("\0"))
    return Copy(counter, {name: value for name, _, value in pairs})


def slots(order: str, left_a: int, left_b: int) -> dict[str, str]:
    """The values that the boot script knows."""
    return {"BOOT_A_LEFT": str(left_a), "BOOT_B_LEFT": str(left_b), "BOOT_ORDER": order}


def latest(copies: Sequence[Copy | None]) -> Copy | None:
    """The copy that counts, as recipes/recipes-bsp/u-boot-ecdaq/files/boot.cmd chooses it."""
    first, second = copies
    if first is None or second is None:
        return first or second
    if {first.counter, second.counter} == {0, 255}:
        return first if first.counter == 0 else second
    return second if second.counter > first.counter else first


def next_slot(copies: Sequence[Copy | None]) -> str | None:
    """The slot that U-Boot starts next; None: no slot is left, each gets its tries again."""
    current = latest(copies)
    values = slots("A B", 3, 3) | (current.values if current else {})
    named = values["BOOT_ORDER"].split()
    return next((s for s in named if int(values.get(f"BOOT_{s}_LEFT", "0"), 16) > 0), None)


def read(disk: Path) -> list[Copy | None]:
    """Both copies of a disk."""
    with disk.open("rb") as file:
        found = []
        for offset, size in PLACES:
            file.seek(offset)
            found.append(unpack(file.read(size)))
        return found


def write(disk: Path, copies: list[bytes]) -> None:
    """Put both copies on a disk, right or wrong."""
    with disk.open("r+b") as file:
        for (offset, size), raw in zip(PLACES, copies, strict=True):
            assert len(raw) == size
            file.seek(offset)
            file.write(raw)
