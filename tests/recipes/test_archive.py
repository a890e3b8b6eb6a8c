# SPDX-License-Identifier: MIT
"""Packages stay those of one state of Debian's archive until ./build.sh image --refresh."""

from __future__ import annotations

import hashlib
import os
import subprocess
import sys
from pathlib import Path

import archive
import pytest
from conftest import TOP
from graph import Graph, Task
from metadata import Metadata

BAKE = TOP / "app/tools/image/bake.py"
RELEASE = """Origin: Debian
Codename: {suite}
Date: {date}
Components: main
MD5Sum:
 d41d8cd98f00b204e9800998ecf8427e 0 main/binary-arm64/Packages
SHA256:
 {packages:0>64} 4711 main/binary-arm64/Packages
 {packages:0>64} 4711 main/source/Sources
"""
DAY_1 = "Thu, 20 Nov 2025 21:02:03 UTC"
DAY_2 = "Fri, 21 Nov 2025 03:02:03 UTC"
TAKES_PACKAGES = [
    Task("sdk-chroot", "do_bootstrap"),
    Task("linux-ecdaq", "do_fetch"),
    Task("ecdaq-image", "do_rootfs_base"),
]


def release(packages: str = "1", date: str = DAY_1, suite: str = "trixie") -> str:
    return RELEASE.format(suite=suite, date=date, packages=packages)


def test_a_suite_that_is_only_signed_again_is_the_same_archive() -> None:
    signed = f"-----BEGIN PGP SIGNED MESSAGE-----\n\nValid-Until: {DAY_2}\n"
    again = signed + release(date=DAY_2) + "-----BEGIN PGP SIGNATURE-----\nabc\n"
    assert archive.state([again])[0] == archive.state([release()])[0]
    assert archive.state([again])[1].isoformat() == "2025-11-21"


def test_other_packages_in_one_suite_are_another_archive() -> None:
    main, updates = release(), release("2", DAY_2)
    assert archive.state([main, updates]) == archive.state([updates, main])
    assert archive.state([main, updates])[0] != archive.state([main, release("3", DAY_2)])[0]
    assert archive.state([main])[0] != archive.state([main, updates])[0]


@pytest.mark.parametrize("text", ["", f"Date: {DAY_1}\n", f"SHA256:\n {64 * '0'} 1 a\n"])
def test_what_is_no_release_file_is_refused(text: str) -> None:
    with pytest.raises(archive.ArchiveError):
        archive.state([release(), text])


def graph(folder: Path, releases: list[str]) -> Graph:
    folder.mkdir()
    (folder / "archive.conf").write_text(archive.configuration(releases))
    settings = {
        **{"MACHINE": "ecdaq-qemuarm64", "DISTRO": "ecdaq", "TMPDIR": str(folder)},
        **{"ECDAQ_TOP": str(TOP), "ECDAQ_COMMIT": "1a2b3c4"},
    }
    return Graph(Metadata(TOP, folder / "build", settings))


def test_tasks_that_take_packages_run_again_for_another_archive_only(tmp_path: Path) -> None:
    first = graph(tmp_path / "first", [release()])
    later = graph(tmp_path / "later", [release(date=DAY_2)])
    other = graph(tmp_path / "other", [release("2")])
    for task in TAKES_PACKAGES:
        assert later.hash(task) == first.hash(task)
        assert other.hash(task) != first.hash(task)


def test_an_image_carries_the_date_of_its_archive(tmp_path: Path) -> None:
    first = graph(tmp_path / "first", [release()])
    later = graph(tmp_path / "later", [release(date=DAY_2)])
    image = later.metadata.recipes["ecdaq-image"].value("name_image")
    assert image.count("2025-11-21") == 2
    rootfs = Task("ecdaq-image", "do_rootfs")
    assert later.hash(rootfs) != first.hash(rootfs)


class Mirror:
    """A mirror in a folder, and a cache that is built from it."""

    def __init__(self, base: Path) -> None:
        self.base = base
        self.site = f"[trusted=yes] file:{base}/mirror"
        self.publish("1", DAY_1)

    def publish(self, packages: str, date: str) -> None:
        for suite in ("trixie", "trixie-updates"):
            folder = self.base / "mirror/dists" / suite
            folder.mkdir(parents=True, exist_ok=True)
            (folder / "Release").write_text(release(packages, date, suite))

    def bake(self, *arguments: str, **more: str) -> subprocess.CompletedProcess[str]:
        folders = ["--cache", str(self.base / "cache"), "--build", str(self.base / "build")]
        return subprocess.run(
            [sys.executable, BAKE, *folders, *arguments],
            env=os.environ | {"ECDAQ_APT_MIRROR": self.site} | more,
            capture_output=True,
            text=True,
            check=False,
        )

    def refresh(self, **more: str) -> subprocess.CompletedProcess[str]:
        return self.bake("--task", "do_refresh", "sdk-chroot", **more)

    def noted(self) -> str:
        return (self.base / "cache/archive.conf").read_text()

    def plan(self) -> str:
        planned = self.bake("--dry-run", "--task", "do_rootfs_base", "ecdaq-image")
        assert "ecdaq-image: rootfs_base\t" in planned.stdout, planned.stderr
        return planned.stdout


@pytest.fixture
def mirror(tmp_path: Path) -> Mirror:
    return Mirror(tmp_path)


def test_a_cache_follows_the_archive_when_it_is_refreshed(mirror: Mirror) -> None:
    assert mirror.refresh().returncode == 0
    before = mirror.plan()
    assert 'ECDAQ_ARCHIVE_DATE = "2025-11-20"' in mirror.noted()
    mirror.publish("2", DAY_2)
    assert mirror.plan() == before
    assert mirror.refresh().returncode == 0
    assert mirror.plan() != before
    assert 'ECDAQ_ARCHIVE_DATE = "2025-11-21"' in mirror.noted()


def test_a_suite_that_cannot_be_read_leaves_the_cache_as_it_is(mirror: Mirror) -> None:
    mirror.refresh()
    before = mirror.noted()
    mirror.publish("2", DAY_2)
    (mirror.base / "mirror/dists/trixie-updates/Release").unlink()
    failed = mirror.refresh()
    assert failed.returncode == 1
    assert "1 of 2 suites could be read" in failed.stdout + failed.stderr
    assert mirror.noted() == before


def test_security_updates_may_come_from_a_mirror_of_their_own(mirror: Mirror) -> None:
    mirror.refresh()
    without = mirror.noted()
    assert mirror.refresh(ECDAQ_APT_SECURITY_MIRROR=mirror.site).returncode == 1
    suite = mirror.base / "mirror/dists/trixie-security"
    suite.mkdir()
    (suite / "Release").write_text(release("3", DAY_2, "trixie-security"))
    assert mirror.refresh(ECDAQ_APT_SECURITY_MIRROR=mirror.site).returncode == 0
    assert 'ECDAQ_ARCHIVE_DATE = "2025-11-21"' in mirror.noted()
    assert mirror.noted() != without


class Script:
    """build-image.sh with the programs that it calls replaced: each call of bake.py is noted."""

    def __init__(self, base: Path) -> None:
        self.base = base
        self.cache = base / "ecdaq/image"
        self.calls = base / "calls"
        tools = base / "bin"
        self.program(tools / "python3", "echo 3")
        self.program(tools / "id", "echo 0")
        self.program(tools / "unshare", 'while [ "$1" != nice ]; do shift; done\nexec "$@"')
        for name in ("mmdebstrap", "arch-test"):
            self.program(tools / name, "exit 0")
        requirements = (TOP / "app/tools/image/requirements.txt").read_bytes()
        name = hashlib.sha256(b"3\n" + requirements).hexdigest()[:12]
        self.bake = self.cache / f"venv-{name}/bin/python"
        self.ends(0)
        (self.cache / f"venv-{name}/.complete").touch()

    def program(self, path: Path, body: str) -> None:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(f"#!/bin/sh\n{body}\n")
        path.chmod(0o755)

    def ends(self, status: int) -> None:
        self.program(self.bake, f'echo "$*" >> {self.calls}\nexit {status}')

    def run(self, *options: str) -> list[str]:
        """The goals that are built, by their last word."""
        self.calls.write_text("")
        path = f"{self.base / 'bin'}:{os.environ['PATH']}"
        subprocess.run(
            [TOP / "app/tools/image/build-image.sh", *options],
            env=os.environ | {"PATH": path, "XDG_CACHE_HOME": str(self.base), "PYTHON": "python3"},
            check=False,
        )
        return [line.split()[-1] for line in self.calls.read_text().splitlines()]


@pytest.fixture
def script(tmp_path: Path) -> Script:
    return Script(tmp_path)


def test_an_empty_cache_begins_with_the_present_archive(script: Script) -> None:
    assert script.run() == ["sdk-chroot", "ecdaq-image"]
    assert script.run("--plan") == ["ecdaq-image"]


@pytest.mark.parametrize("there", ["archive.conf", "sdk"])
def test_a_cache_that_is_used_keeps_its_archive_until_refresh(script: Script, there: str) -> None:
    (script.cache / there).touch()
    assert script.run() == ["ecdaq-image"]
    assert script.run("--refresh") == ["sdk-chroot", "ecdaq-image"]


def test_without_the_archive_nothing_is_built(script: Script) -> None:
    script.ends(1)
    assert script.run("--refresh") == ["sdk-chroot"]
