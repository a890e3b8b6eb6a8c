# SPDX-License-Identifier: MIT
"""Read a kickstart file (.wks) of OpenEmbedded's wic: the few words of it that our images use."""

from __future__ import annotations

import argparse
import shlex
from dataclasses import dataclass
from pathlib import Path

UNITS = {"K": 1024, "M": 1024**2, "G": 1024**3}
SOURCES = ("rootfs", "bootimg-partition", "empty")


class WksError(Exception):
    """FILE:LINE: what is wrong."""


@dataclass(frozen=True)
class Partition:
    """One `part` line."""

    source: str
    fstype: str
    label: str
    size_bytes: int
    uuid: str
    mkfs_options: str = ""


@dataclass(frozen=True)
class Layout:
    """A whole file: kind and identity of the partition table, and the partitions in order."""

    table: str
    identity: str
    partitions: tuple[Partition, ...]

    def find(self, source: str) -> Partition:
        """The first partition filled from `source`."""
        return next(p for p in self.partitions if p.source == source)


class _Parser(argparse.ArgumentParser):
    def error(self, message: str) -> None:  # type: ignore[override]
        raise WksError(message)


def _size(text: str) -> int:
    unit = UNITS.get(text[-1:])
    number = text[:-1] if unit else text
    if not number.isdigit():
        raise WksError(f"'{text}' is no size like 128M")
    return int(number) * (unit or UNITS["M"])


def _part_parser() -> _Parser:
    parser = _Parser(add_help=False)
    parser.add_argument("mountpoint", nargs="?", default="")
    parser.add_argument("--source", choices=SOURCES, default="")
    parser.add_argument("--fstype", choices=("vfat", "ext4"), default="")
    parser.add_argument("--label", required=True)
    parser.add_argument("--part-name", default="")
    parser.add_argument("--fixed-size", required=True)
    parser.add_argument("--uuid", default="")
    parser.add_argument("--mkfs-extraopts", default="")
    parser.add_argument("--active", action="store_true")
    parser.add_argument("--align", type=int, default=4096)
    return parser


def _parse_bootloader(words: list[str]) -> tuple[str, str]:
    parser = _Parser(add_help=False)
    parser.add_argument("--ptable", choices=("gpt", "msdos"), default="msdos")
    parser.add_argument("--diskid", default="")
    given = parser.parse_args(words)
    return given.ptable, given.diskid


def _parse_part(words: list[str]) -> Partition:
    given = _part_parser().parse_args(words)
    if given.mountpoint not in ("", "/"):
        raise WksError(
            f"wic would write {given.mountpoint} to /etc/fstab; preinit mounts partitions"
        )
    return Partition(
        source=given.source,
        fstype=given.fstype,
        label=given.label,
        size_bytes=_size(given.fixed_size),
        uuid=given.uuid,
        mkfs_options=given.mkfs_extraopts,
    )


def parse(path: Path) -> Layout:
    """The layout in `path`; WksError with file and line if it is not one of ours."""
    table, identity = "msdos", ""
    partitions: list[Partition] = []
    for number, line in enumerate(path.read_text().splitlines(), 1):
        try:
            words = shlex.split(line, comments=True)
            if words[:1] == ["bootloader"]:
                table, identity = _parse_bootloader(words[1:])
            elif words[:1] in (["part"], ["partition"]):
                partitions.append(_parse_part(words[1:]))
            elif words:
                raise WksError(f"'{words[0]}' is not understood here")
        except (WksError, ValueError) as error:
            raise WksError(f"{path}:{number}: {error}") from error
    for source in ("rootfs", "bootimg-partition"):
        if sum(p.source == source for p in partitions) != 1:
            raise WksError(f"{path}: exactly one partition has to be of --source {source}")
    if table == "msdos" and len(partitions) > 4:
        raise WksError(f"{path}: an msdos table holds four partitions")
    return Layout(table, identity, tuple(partitions))
