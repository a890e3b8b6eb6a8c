# SPDX-License-Identifier: MIT
"""app/tools/image/build-image.sh, with stand-ins for Python and the tools that it needs."""

from __future__ import annotations

import os
import subprocess
from pathlib import Path

import pytest

SCRIPT = Path(__file__).parents[2] / "app" / "tools" / "image" / "build-image.sh"
# Makes an environment whose Python mounts something and prints where.
PYTHON = """#!/bin/sh
case "$*" in
-c*) echo 3 ;;
*venv*) mkdir -p "$3/bin" && cp "$0.build" "$3/bin/python" ;;
esac
"""
BUILD = """#!/bin/sh
case "$*" in *pip*) exit 0 ;; esac
mount -t tmpfs none "$MOUNT_HERE" && grep " $MOUNT_HERE " /proc/self/mounts
"""


def program(path: Path, text: str) -> None:
    path.write_text(text)
    path.chmod(0o755)


@pytest.mark.skipif(os.geteuid() != 0, reason="needs root")
def test_what_a_build_mounts_goes_with_it(tmp_path: Path) -> None:
    tools = tmp_path / "bin"
    tools.mkdir()
    for name in ("mmdebstrap", "arch-test"):
        program(tools / name, "#!/bin/sh\n")
    program(tmp_path / "python", PYTHON)
    program(tmp_path / "python.build", BUILD)
    here = tmp_path / "mounted"
    here.mkdir()
    done = subprocess.run(
        ["sh", SCRIPT],
        env=os.environ
        | {
            "PATH": f"{tools}:{os.environ['PATH']}",
            "PYTHON": str(tmp_path / "python"),
            "XDG_CACHE_HOME": str(tmp_path / "cache"),
            "MOUNT_HERE": str(here),
        },
        capture_output=True,
        text=True,
        check=False,
    )
    mounted_here = os.path.ismount(here)
    if mounted_here:
        subprocess.run(["umount", here], check=True)
    assert done.returncode == 0, done.stderr
    assert str(here) in done.stdout
    assert not mounted_here
