# SPDX-License-Identifier: MIT
"""The `sh` blocks of README and of the tutorials, in order in a fresh clone, one shell per page.

A block that cannot run there is preceded by `<!-- not run: REASON -->`.
"""

from __future__ import annotations

import contextlib
import os
import re
import signal
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
# In the order of a first day: the first page builds, the others use what it built.
PAGES = (
    "README.md",
    "app/doc/tutorial/first-run.md",
    "app/doc/tutorial/first-plot.md",
    "app/doc/tutorial/notebook.md",
    "app/doc/tutorial/first-real-slave.md",
)
PAGE_SECONDS = 1800
# The pages name a fixed run directory, which a user of this machine may have in use.
RUN_DIR = re.compile(r"/dev/shm/ecdaq-\w+")
BLOCK = re.compile(r"(<!-- not run: (\S[^>]*) -->\n+)?```sh\n(.*?)```", re.DOTALL)


def blocks(page: str) -> list[str]:
    """The blocks of @page that are to be run."""
    text = RUN_DIR.sub(f"/dev/shm/ecdaq-docs-{os.getpid()}", (ROOT / page).read_text())
    return [command for skipped, _, command in BLOCK.findall(text) if not skipped]


@pytest.fixture(scope="module")
def clone(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("docs") / "ecdaq"
    subprocess.run(["git", "clone", "--quiet", str(ROOT), str(folder)], check=True)
    return folder


def environment(clone: Path) -> dict[str, str]:
    """A user's, who has no settings of ecdaq, but compiled the same text in another folder before
    (ccache) and does not wait for pip to compile all of pandas."""
    own = {name: value for name, value in os.environ.items() if not name.startswith("ECDAQ_")}
    return own | {"CCACHE_BASEDIR": str(clone), "CCACHE_NOHASHDIR": "1", "PIP_COMPILE": "0"}


def test_every_tutorial_is_run() -> None:
    pages = {str(path.relative_to(ROOT)) for path in (ROOT / "app/doc/tutorial").glob("*.md")}
    assert pages == set(PAGES[1:])


@pytest.mark.parametrize("page", PAGES)
def test_the_commands_of_the_page_work_in_a_fresh_clone(clone: Path, page: str) -> None:
    commands = blocks(page)
    assert commands
    script = "set -eu\n" + "".join(f"echo '--- block {i}' >&2\n{c}" for i, c in enumerate(commands))
    with (clone / "shell.log").open("w") as log:
        shell = subprocess.Popen(
            ["sh", "-c", script],
            cwd=clone,
            env=environment(clone),
            stdin=subprocess.DEVNULL,
            stdout=log,
            stderr=log,
            start_new_session=True,
        )
        try:
            code = shell.wait(PAGE_SECONDS)
        except subprocess.TimeoutExpired:
            code = 124
        finally:
            with contextlib.suppress(ProcessLookupError):
                os.killpg(shell.pid, signal.SIGTERM)
    tail = (clone / "shell.log").read_text(errors="replace").splitlines()[-40:]
    assert code == 0, "\n".join(tail)
