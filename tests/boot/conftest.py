# SPDX-License-Identifier: MIT
"""One virtual machine a test file: fixtures, and the console log where a test failed."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))
from machine import AHEAD, IMAGE, NAME, Machine, Space

SSH_S = 600
KEEP = Path(__file__).resolve().parents[2] / "build" / "test-logs"


@pytest.fixture(scope="session")
def image() -> Path:
    """The image under test. No image is a failure, not a skip."""
    disk = IMAGE / f"{NAME}.img"
    assert disk.exists(), "no image in build/image/ecdaq-qemuarm64: run ./build.sh image first"
    assert os.geteuid() == 0, "boot tests need root (QEMU runs in the image chroot)"
    return disk


@pytest.fixture(scope="session")
def key(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A key pair of this run; the public half has .pub behind its name."""
    path = tmp_path_factory.mktemp("key") / "key"
    subprocess.run(["ssh-keygen", "-q", "-t", "ed25519", "-N", "", "-f", path], check=True)
    return path


@pytest.fixture(scope="module")
def machine(
    request: pytest.FixtureRequest, image: Path, key: Path, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[Machine]:
    """The machine of a file, set up by its BOOT_FILES, up to its login. What is needed in the space
    before it starts is the context manager of the file's beside(space)."""
    module = request.module
    space = Space() if getattr(module, "OUTSIDE", False) else None
    around = ExitStack()
    vm = Machine(
        tmp_path_factory.mktemp("vm"), image, key, getattr(module, "TIMING", "guest"), space
    )
    files = dict(getattr(module, "BOOT_FILES", {}))
    if getattr(module, "WITH_KEY", True):
        files["authorized_keys"] = key.with_suffix(".pub").read_text()
    failed_before = request.session.testsfailed
    try:
        if hasattr(module, "beside"):
            around.enter_context(module.beside(space))
        vm.write_boot_files(files)
        if getattr(module, "WIRE", False):
            vm.start(options=vm.wire_options(), ahead=AHEAD)
        else:
            vm.start(**getattr(module, "START", {}))
        vm.wait_for_login()
        if getattr(module, "WITH_KEY", True):
            # Its key is made at the first boot, which may take longer than the login prompt.
            vm.wait_until("SSH answers", "true", SSH_S)
        yield vm
    finally:
        vm.stop()
        around.close()
        if space is not None:
            space.close()
        if request.session.testsfailed > failed_before or vm.has_console():
            KEEP.mkdir(parents=True, exist_ok=True)
            target = KEEP / f"console-{Path(module.__file__).stem}.log"
            target.write_text(vm.console())
