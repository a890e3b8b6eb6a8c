# SPDX-License-Identifier: MIT
"""What the runner keeps of earlier builds."""

from __future__ import annotations

import os
from pathlib import Path

from execute import RESULTS_KEPT, Executor, copy_tree
from graph import Graph, Task
from metadata import Metadata


def test_results_not_used_for_long_are_removed(metadata: Metadata, tmp_path: Path) -> None:
    folder = tmp_path / "objects" / "ecdaq-image"
    for name in ("do_rootfs", "do_rootfs_base"):
        for age in range(RESULTS_KEPT + 2):
            result = folder / f"{name}-{age}"
            result.mkdir(parents=True)
            os.utime(result, (1000 - age, 1000 - age))
    Executor(Graph(metadata), tmp_path, 1).make_room(Task("ecdaq-image", "do_rootfs"))
    left = {p.name for p in folder.iterdir()}
    wanted = {f"do_rootfs-{age}" for age in range(RESULTS_KEPT)}
    wanted |= {f"do_rootfs_base-{age}" for age in range(RESULTS_KEPT + 2)}
    assert left == wanted


def test_a_disk_image_takes_the_space_of_its_data(tmp_path: Path) -> None:
    source = tmp_path / "source"
    source.mkdir()
    (source / "disk.img").write_bytes(bytes(16 << 20))
    (source / "link").symlink_to("disk.img")
    copy_tree(source, tmp_path / "target")
    copy = tmp_path / "target" / "disk.img"
    assert copy.read_bytes() == (source / "disk.img").read_bytes()
    assert copy.stat().st_blocks * 512 < 1 << 20
    assert (tmp_path / "target" / "link").is_symlink()


def test_an_image_that_is_made_is_still_copied_to_the_build_folder(
    metadata: Metadata, tmp_path: Path
) -> None:
    executor = Executor(Graph(metadata), tmp_path, 1)
    goal = Task("ecdaq-image", "do_build")
    for task in executor.plan(goal):
        executor._write_stamp(task)
    assert executor.plan(goal) == [Task("ecdaq-image", "do_deploy"), goal]
