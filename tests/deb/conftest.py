# SPDX-License-Identifier: MIT
"""Two versions of the packages as README builds them, and a machine to install them on."""

from __future__ import annotations

import os
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest

TOP = Path(__file__).resolve().parents[2]
TOOLS = TOP / "app/tools/deb"
OLD, NEW = "~old", ""


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


@pytest.fixture(scope="session")
def packages(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder with old/ and new/."""
    if os.geteuid() != 0:
        pytest.skip("needs root: the packages are built and installed in chroots")
    folder = tmp_path_factory.mktemp("packages")
    for name, suffix in (("old", OLD), ("new", NEW)):
        command = [TOP / "build.sh", "deb", "--to", folder / name]
        if suffix:
            command += ["--suffix", suffix]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr[-6000:]
    return folder


@pytest.fixture(scope="session")
def machine(packages: Path) -> Iterator[Machine]:
    files = sorted((packages / "new").glob("*.deb"))
    tree = subprocess.run(
        [TOOLS / "install-tree.sh", *files], stdout=subprocess.PIPE, text=True, check=True
    ).stdout.strip()
    machine = Machine(tree, packages)
    yield machine
    machine.close()
