# SPDX-License-Identifier: MIT
"""The boot state as it is on the disk: two copies in the format of U-Boot's redundant
environment."""

from __future__ import annotations

import re
import struct
import zlib
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
