# SPDX-License-Identifier: MIT
"""First boot: the file system of the data partition grows to the size of the disk, and a start that
ends in the middle of it is made good by the next one. The functions are those of preinit."""

from __future__ import annotations

import os
import re
import shlex
import shutil
import subprocess
from dataclasses import dataclass
from pathlib import Path

import pytest
import wks
from conftest import TOP

PREINIT = TOP / "recipes/recipes-core/ecdaq-config/files/root/usr/lib/ecdaq/preinit"
LAYOUTS = sorted((TOP / "layers/meta-ecdaq/wic").glob("*.wks"))
GIB = 1 << 30
POINTS = 12
RECORDED = 8 << 20
SBIN = os.environ | {"PATH": os.environ["PATH"] + ":/usr/sbin:/sbin", "LC_ALL": "C"}

pytestmark = pytest.mark.skipif(not shutil.which("strace"), reason="no strace here")


def run(*command: str | Path) -> str:
    done = subprocess.run(command, env=SBIN, check=True, capture_output=True, text=True)
    return done.stdout


def function(name: str) -> str:
    """A function of preinit, as it is."""
    found = re.search(
        rf"^{name}\(\)\n\{{\n.*?^\}}\n", PREINIT.read_text(), re.MULTILINE | re.DOTALL
    )
    assert found, f"preinit has no function {name}"
    return found[0]


@dataclass(frozen=True)
class Machine:
    """A disk of some size, of which only the data partition is there."""

    place: Path
    size_bytes: int

    @property
    def data(self) -> Path:
        return self.place / "data"

    def start(self, kill_at: int = 0) -> str:
        """What preinit does between sfdisk and mount. resize2fs is killed at the write with the
        number kill_at, which is not made; those before it are on the disk.
        """
        fault = f"-e inject=pwrite64:signal=KILL:when={kill_at}" if kill_at else ""
        strace = f"strace -o {self.place}/writes -e trace=pwrite64 {fault} resize2fs"
        script = "\n".join(
            (
                "set -u",
                'say() { echo "$2"; }',
                f'resize2fs() {{ {strace} "$@"; }}',
                function("check_data"),
                function("grow_file_system"),
                f"data={self.data}",
                "check_data && grow_file_system",
            )
        )
        sysfs = self.place / "sys/class/block/data"
        sysfs.mkdir(parents=True, exist_ok=True)
        (sysfs / "size").write_text(f"{self.size_bytes // 512}\n")
        (self.place / "run").mkdir(exist_ok=True)
        for own in ("/sys/class/block/", "/run/"):
            assert own in script
            script = script.replace(own, f"{self.place}{own}")
        return run("sh", "-c", script)

    def writes(self) -> int:
        return (self.place / "writes").read_text().count("pwrite64(")

    def is_as_large_as_the_disk(self) -> bool:
        blocks = re.search(
            r"^Block count:\s+(\d+)$", run("dumpe2fs", "-h", self.data), re.MULTILINE
        )
        return blocks is not None and int(blocks[1]) * 4096 == self.size_bytes

    def recorded(self) -> bytes:
        run("debugfs", "-R", f"dump /record/a.mcap {self.place}/dumped", self.data)
        return (self.place / "dumped").read_bytes()


def partition(layout: Path, place: Path, gib: int) -> tuple[Machine, bytes]:
    """The partition as sfdisk has just made it larger, with a recording in it."""
    part = next(p for p in wks.parse(layout).partitions if p.label == "data")
    machine = Machine(place, gib * GIB)
    (place / "files/record").mkdir(parents=True)
    recorded = os.urandom(RECORDED)
    (place / "files/record/a.mcap").write_bytes(recorded)
    with machine.data.open("wb") as file:
        file.truncate(part.size_bytes)
    options = shlex.split(part.mkfs_options)
    run("mke2fs", "-q", "-t", part.fstype, *options, "-d", place / "files", machine.data)
    os.truncate(machine.data, machine.size_bytes)
    return machine, recorded


@pytest.mark.parametrize("layout", LAYOUTS, ids=lambda p: p.stem)
@pytest.mark.parametrize("gib", [8, 512])
def test_a_growth_that_ends_in_the_middle_is_made_good_by_the_next_start(
    layout: Path, gib: int, tmp_path: Path
) -> None:
    machine, recorded = partition(layout, tmp_path, gib)
    before = tmp_path / "before"
    run("cp", "--sparse=always", machine.data, before)
    machine.start()
    total = machine.writes()
    assert machine.is_as_large_as_the_disk()
    assert total > POINTS
    for point in range(POINTS):
        kill_at = 1 + point * (total - 1) // (POINTS - 1)
        run("cp", "--sparse=always", before, machine.data)
        assert "not grown" in machine.start(kill_at), f"write {kill_at} of {total} ended nothing"
        machine.start()
        assert machine.is_as_large_as_the_disk(), f"write {kill_at} of {total}"
        run("e2fsck", "-f", "-n", machine.data)
        assert machine.recorded() == recorded, f"write {kill_at} of {total}"
    print(f"\n{gib} GiB, {layout.stem}: {POINTS} of {total} writes, all made good", end="")
