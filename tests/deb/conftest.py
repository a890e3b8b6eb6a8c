# SPDX-License-Identifier: MIT
"""Packages as README builds them, of two versions; those for arm64; machines for them."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest

TOP = Path(__file__).resolve().parents[2]
TOOLS = TOP / "app/tools/deb"
OLD = "~old"


class Machine:
    """A clean Debian tree, in one shell, so that what a command changes is there for the next."""

    def __init__(self, tree: str, folder: Path) -> None:
        self.folder = folder
        self.shell = subprocess.Popen(
            [TOOLS / "in-chroot.sh", tree, folder, "bash"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        )

    def try_run(self, command: str) -> tuple[int, str]:
        """Exit code and output."""
        assert self.shell.stdin is not None and self.shell.stdout is not None
        self.shell.stdin.write(
            f"{{ {command}\n}} < /dev/null\ncode=$?; echo; echo '==end==' $code\n"
        )
        self.shell.stdin.flush()
        lines = []
        for line in self.shell.stdout:
            if line.startswith("==end=="):
                return int(line.split()[1]), "".join(lines).strip()
            lines.append(line)
        raise AssertionError(f"{command}: the machine ended: {''.join(lines)}")

    def run(self, command: str) -> str:
        code, output = self.try_run(command)
        assert code == 0, f"{command}: {code}\n{output}"
        return output

    def close(self) -> None:
        assert self.shell.stdin is not None
        self.shell.stdin.close()
        self.shell.wait(60)


def build(folder: Path, arch: str) -> None:
    if os.geteuid() != 0:
        pytest.skip("needs root: the packages are built and installed in chroots")
    command = [TOP / "build.sh", "deb", "--to", folder, arch]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr[-6000:]


def with_suffix(package: Path, suffix: str, folder: Path) -> None:
    """The same package with an older version; its relations to the others are of that version."""
    tree = folder / package.stem
    subprocess.run(["dpkg-deb", "--raw-extract", package, tree], check=True)
    control = tree / "DEBIAN/control"
    text = control.read_text()
    (version,) = re.findall(r"^Version: (.*)$", text, re.MULTILINE)
    text = text.replace(f"Version: {version}", f"Version: {version}{suffix}")
    control.write_text(text.replace(f"(= {version})", f"(= {version}{suffix})"))
    name, _, arch = package.stem.split("_")
    to = folder / f"{name}_{version}{suffix}_{arch}.deb"
    subprocess.run(["dpkg-deb", "--root-owner-group", "-Znone", "--build", tree, to], check=True)
    shutil.rmtree(tree)


@pytest.fixture(scope="session")
def packages(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder with old/ and new/."""
    folder = tmp_path_factory.mktemp("packages")
    (folder / "old").mkdir()
    build(folder / "new", "amd64")
    for package in (folder / "new").glob("*.deb"):
        with_suffix(package, OLD, folder / "old")
    return folder


@pytest.fixture(scope="session")
def arm64_packages(packages: Path) -> Path:
    """The same folder, with arm64/ too."""
    build(packages / "arm64", "arm64")
    return packages


def installable(files: list[Path], folder: Path) -> Machine:
    tree = subprocess.run(
        [TOOLS / "install-tree.sh", *files], stdout=subprocess.PIPE, text=True, check=True
    ).stdout.strip()
    return Machine(tree, folder)


@pytest.fixture(scope="session")
def machine(packages: Path) -> Iterator[Machine]:
    machine = installable(sorted((packages / "new").glob("*.deb")), packages)
    yield machine
    machine.close()


@pytest.fixture(scope="session")
def arm64_machine(arm64_packages: Path) -> Iterator[Machine]:
    """It has programs and libraries of arm64 beside its own."""
    machine = installable(sorted((arm64_packages / "arm64").glob("*.deb")), arm64_packages)
    yield machine
    machine.close()
