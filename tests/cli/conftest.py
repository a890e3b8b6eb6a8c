# SPDX-License-Identifier: MIT
from __future__ import annotations

import shutil
import sys
import tempfile
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))

from ecdaq import Fake
from made_machine import Machine
from recording import PRODUCER, RECORD, Bench
from terminal import Terminal


@pytest.fixture
def run_dir() -> Iterator[Path]:
    """A run directory that others may enter, on a tmpfs, with a short path (it holds a socket)."""
    path = Path(tempfile.mkdtemp(prefix="ecdaq-cli-", dir="/dev/shm"))
    path.chmod(0o755)
    yield path
    shutil.rmtree(path)


@pytest.fixture
def fake(run_dir: Path) -> Iterator[Callable[..., Fake]]:
    """Starts a fake ecdaqd with the settings given."""
    started: list[Fake] = []

    def start(*settings: str, how: Sequence[str] = ()) -> Fake:
        started.append(Fake(run_dir, *settings, how=how))
        return started[-1]

    yield start
    for one in started:
        one.close()


@pytest.fixture
def daemon(fake: Callable[..., Fake]) -> Fake:
    """A fake ecdaqd, ten times as fast as a real one."""
    return fake("SPEED=10")


@pytest.fixture
def machine(tmp_path: Path) -> Machine:
    return Machine(tmp_path)


@pytest.fixture
def bench(run_dir: Path, tmp_path: Path) -> Iterator[Bench]:
    for program in (RECORD, PRODUCER):
        if not program.exists():
            pytest.fail(f"{program} is not there: run ./build.sh build")
    made = Bench(run_dir, tmp_path / "records")
    made.folder.mkdir()
    yield made
    made.close()


@pytest.fixture
def terminal() -> Iterator[Terminal]:
    one = Terminal(24, 90)
    yield one
    one.close()
