# SPDX-License-Identifier: MIT
"""The file system of the data partition, made as the layouts say and grown as on a card."""

from __future__ import annotations

import os
import re
import shlex
import subprocess
from pathlib import Path

import pytest
import wks
from conftest import TOP

LAYOUTS = sorted((TOP / "layers/meta-ecdaq/wic").glob("*.wks"))
GIB = 1 << 30
SBIN = os.environ | {"PATH": os.environ["PATH"] + ":/usr/sbin:/sbin"}


def run(*command: str | Path) -> str:
    done = subprocess.run(command, env=SBIN, check=True, capture_output=True, text=True)
    return done.stdout


def figures(disk: Path) -> dict[str, int]:
    """The numbers of dumpe2fs -h."""
    found = re.findall(r"^([A-Z][A-Za-z ]+):\s+(\d+)M?$", run("dumpe2fs", "-h", disk), re.M)
    return {name: int(value) for name, value in found}


@pytest.fixture(params=LAYOUTS, ids=lambda p: p.stem)
def data(request: pytest.FixtureRequest, tmp_path: Path) -> Path:
    """The file system of a layout's data partition, empty."""
    part = next(p for p in wks.parse(request.param).partitions if p.label == "data")
    disk = tmp_path / "data"
    with disk.open("wb") as file:
        file.truncate(part.size_bytes)
    run("mke2fs", "-q", "-t", part.fstype, *shlex.split(part.mkfs_options), disk)
    return disk


@pytest.mark.parametrize("gib", [8, 512])
def test_a_grown_partition_is_for_recordings_not_for_its_tables(data: Path, gib: int) -> None:
    os.truncate(data, gib * GIB)
    run("e2fsck", "-f", "-p", data)
    run("resize2fs", data)
    run("e2fsck", "-f", "-n", data)
    got = figures(data)
    assert got["Block size"] == 4096
    assert got["Block count"] * 4096 == gib * GIB
    assert got["Inode count"] >= 100_000
    tables = got["Inode count"] * got["Inode size"]
    reserved = got["Reserved block count"] * 4096
    print(f"\n{gib} GiB: {got['Inode count']} inodes, tables {tables >> 20} MiB,", end=" ")
    print(f"reserved {reserved >> 20} MiB, journal {got['Total journal size']} MiB")
    assert tables <= gib * GIB // 200
    assert reserved <= gib * GIB // 99
    assert got["Total journal size"] >= 32
