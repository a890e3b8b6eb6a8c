# SPDX-License-Identifier: MIT
"""compare_packages.py finds each kind of difference of two packages."""

from __future__ import annotations

import gzip
import os
import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path

import compare_packages
import pytest

pytestmark = pytest.mark.skipif(not shutil.which("dpkg-deb"), reason="dpkg-deb is not installed")

ISAR = os.environ.get("ECDAQ_ISAR_PACKAGES", "")
CONTROL = """\
Package: tool
Version: 1.0
Architecture: all
Maintainer: Someone <someone@example.org>
Description: a tool
 that does nothing
"""


def make_tree(root: Path) -> None:
    for name, text in (
        ("DEBIAN/control", CONTROL),
        ("DEBIAN/conffiles", "/etc/tool.conf\n"),
        ("DEBIAN/postinst", "#!/bin/sh\n"),
        ("etc/tool.conf", "a = 1\n"),
        ("usr/bin/tool", "#!/bin/sh\n"),
    ):
        (root / name).parent.mkdir(parents=True, exist_ok=True)
        (root / name).write_text(text)
    (root / "DEBIAN/postinst").chmod(0o755)
    (root / "usr/bin/tool").chmod(0o755)
    (root / "usr/bin/link").symlink_to("tool")
    write_changelog(root, "one\n")


def write_changelog(root: Path, text: str) -> None:
    path = root / "usr/share/doc/tool/changelog.gz"
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(gzip.compress(text.encode(), mtime=0))


def build(root: Path, folder: Path, *options: str) -> None:
    folder.mkdir(exist_ok=True)
    subprocess.run(
        ["dpkg-deb", *(options or ("--root-owner-group",)), "-b", root, folder],
        check=True,
        capture_output=True,
    )


@pytest.fixture
def folders(tmp_path: Path) -> tuple[Path, Path]:
    """Ours, built, and a tree for Isar's."""
    for name in ("ours", "isar"):
        make_tree(tmp_path / f"{name}-tree")
    build(tmp_path / "ours-tree", tmp_path / "ours")
    return tmp_path / "ours", tmp_path / "isar-tree"


def compare(ours: Path, tree: Path) -> list[str]:
    build(tree, tree.parent / "isar")
    return compare_packages.compare_folders(ours, tree.parent / "isar")


def replace(tree: Path, name: str, old: str, new: str) -> None:
    path = tree / name
    assert old in path.read_text()
    path.write_text(path.read_text().replace(old, new))


def turn_into_file(tree: Path) -> None:
    (tree / "usr/bin/link").unlink()
    (tree / "usr/bin/link").write_text("tool")


def relink(tree: Path) -> None:
    (tree / "usr/bin/link").unlink()
    (tree / "usr/bin/link").symlink_to("other")


KINDS: dict[str, tuple[Callable[[Path], object], str]] = {
    "field": (
        lambda t: replace(t, "DEBIAN/control", "1.0", "1.1"),
        "tool: field Version: 1.0, Isar: 1.1",
    ),
    "missing field": (
        lambda t: replace(t, "DEBIAN/control", "Version", "Depends: libc6\nVersion"),
        "tool: field Depends: none, Isar: libc6",
    ),
    "continued field": (
        lambda t: replace(t, "DEBIAN/control", "nothing", "something"),
        "tool: field Description: a tool\n that does nothing, Isar: a tool\n that does something",
    ),
    "maintainer script": (
        lambda t: replace(t, "DEBIAN/postinst", "#!/bin/sh\n", "#!/bin/sh\nexit 1\n"),
        "tool: ./postinst: contents: SHA-256 ",
    ),
    "missing control file": (
        lambda t: (t / "DEBIAN/conffiles").unlink(),
        "tool: ./conffiles: not in Isar's package",
    ),
    "missing file": (
        lambda t: (t / "usr/bin/tool").unlink(),
        "tool: ./usr/bin/tool: not in Isar's package",
    ),
    "additional file": (
        lambda t: (t / "etc/other.conf").write_text(""),
        "tool: ./etc/other.conf: only in Isar's package",
    ),
    "mode": (
        lambda t: (t / "usr/bin/tool").chmod(0o4755),
        "tool: ./usr/bin/tool: mode: 755, Isar: 4755",
    ),
    "contents": (
        lambda t: replace(t, "etc/tool.conf", "a = 1", "a = 2"),
        "tool: ./etc/tool.conf: contents: SHA-256 ",
    ),
    "type": (turn_into_file, "tool: ./usr/bin/link: type: symbolic link, Isar: file"),
    "target": (relink, "tool: ./usr/bin/link: target: tool, Isar: other"),
}


def test_packages_that_differ_in_time_and_changelog_are_equal(folders: tuple[Path, Path]) -> None:
    ours, tree = folders
    os.utime(tree / "etc/tool.conf", (1, 1))
    write_changelog(tree, "another\n")
    assert compare(ours, tree) == []


@pytest.mark.parametrize(("change", "line"), KINDS.values(), ids=KINDS)
def test_a_difference_is_found(
    folders: tuple[Path, Path], change: Callable[[Path], object], line: str
) -> None:
    change(folders[1])
    found = compare(*folders)
    assert any(entry.startswith(line) for entry in found), found


def test_another_owner_is_found(folders: tuple[Path, Path]) -> None:
    ours, tree = folders
    build(tree, tree.parent / "isar")
    (package,) = (tree.parent / "isar").glob("*.deb")
    # dpkg-deb takes owners from the disk, where only root could change them.
    data = tree.parent / "data.tar.xz"
    owner = ("--owner=games:5", "--group=root:0", "--exclude=./DEBIAN")
    subprocess.run(["tar", "-cJf", data, *owner, "-C", tree, "."], check=True)
    subprocess.run(["ar", "r", package, data], check=True)
    found = compare_packages.compare_folders(ours, tree.parent / "isar")
    assert "tool: ./usr/bin/tool: owner: root(0):root(0), Isar: games(5):root(0)" in found


def test_a_package_that_isar_did_not_make_is_found(folders: tuple[Path, Path]) -> None:
    ours, tree = folders
    replace(tree, "DEBIAN/control", "Package: tool", "Package: other")
    assert compare(ours, tree) == ["tool: Isar made no such package"]


def test_the_command_prints_differences_and_exits_with_1(
    folders: tuple[Path, Path], capsys: pytest.CaptureFixture[str]
) -> None:
    ours, tree = folders
    isar = tree.parent / "isar"
    build(tree, isar)
    assert compare_packages.main([str(isar), str(ours)]) == 0
    assert capsys.readouterr().out == ""
    (tree / "usr/bin/tool").unlink()
    build(tree, isar)
    assert compare_packages.main([str(isar), str(ours)]) == 1
    assert "tool: ./usr/bin/tool: not in Isar's package\n" in capsys.readouterr().out


def test_without_packages_the_command_exits_with_2(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert compare_packages.main([str(tmp_path), str(tmp_path)]) == 2
    assert capsys.readouterr().err == f"compare_packages: {tmp_path}: no .deb files\n"
    (tmp_path / "a_1_all.deb").write_text("no package")
    assert compare_packages.main([str(tmp_path), str(tmp_path)]) == 2
    assert "a_1_all.deb" in capsys.readouterr().err


@pytest.mark.skipif(not ISAR, reason="ECDAQ_ISAR_PACKAGES names no folder with Isar's packages")
def test_both_roads_make_equal_packages() -> None:
    assert compare_packages.compare_folders(compare_packages.OURS, Path(ISAR)) == []
