# SPDX-License-Identifier: MIT
from __future__ import annotations

import shutil
import signal
import sys
import tempfile
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import pytest

sys.path.insert(0, str(Path(__file__).parent))

from browser import Browser, find
from ecdaq import FAKE, Fake
from made_machine import Machine
from recording import PRODUCER, RECORD, Bench
from terminal import Terminal
from web_bench import WEB, Web
from web_session import WebCommand


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

    def start(*settings: str, how: Sequence[str] = (), program: Path = FAKE) -> Fake:
        started.append(Fake(run_dir, *settings, how=how, program=program))
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


@pytest.fixture
def make_web(bench: Bench) -> Iterator[Callable[..., Web]]:
    if not WEB.exists():
        pytest.skip("ecdaq-web is not built: it requires libwebsockets-dev and libcjson-dev")
    made: list[Web] = []

    def make(config: Path | None = None, **settings: str) -> Web:
        made.append(Web(bench, config, **{k.replace("_", "."): v for k, v in settings.items()}))
        return made[-1]

    yield make
    for web in made:
        if web.process.poll() is None:
            web.process.send_signal(signal.SIGCONT)
            web.stop()


@pytest.fixture
def web(make_web: Callable[..., Web]) -> Web:
    return make_web()


@pytest.fixture
def web_command(bench: Bench) -> WebCommand:
    return WebCommand(bench)


@pytest.fixture
def make_browser(tmp_path: Path) -> Iterator[Callable[..., Browser]]:
    if find() is None:
        pytest.skip("no chromium-headless-shell here: the page is not looked at in a browser")
    made: list[Browser] = []

    def make(web: Web, place: str = "", **arguments: Any) -> Browser:
        made.append(Browser(tmp_path, f"http://127.0.0.1:{web.port}/{place}", **arguments))
        return made[-1]

    yield make
    for browser in made:
        browser.close()
