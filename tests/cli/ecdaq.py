# SPDX-License-Identifier: MIT
"""What the tests of `ecdaq` share: where the programs are, running it, and the fake ecdaqd."""

from __future__ import annotations

import contextlib
import json
import os
import signal
import subprocess
import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[2]
STAGE = Path(os.environ.get("ECDAQ_STAGE", ROOT / "build" / "stage"))
BIN = Path(os.environ.get("ECDAQ_BIN_DIR", STAGE / "bin"))
BUILD = Path(os.environ.get("ECDAQ_BUILD", ROOT / "build" / "release"))
ECDAQ = BIN / "ecdaq"
FAKE = BUILD / "tests" / "cli" / "test_fake_daemon"
NOBODY = 65534

# app/core/program/exit_code.h
OK, FAILED, USAGE, CONFIG, PERMISSION, BUSY = 0, 1, 2, 3, 4, 6
NO_DAEMON, REFUSED, CHECK_FAILED, DISABLED = 16, 17, 18, 19

Result = subprocess.CompletedProcess[str]


def environment(run_dir: Path | None, **more: str) -> dict[str, str]:
    kept = {k: v for k, v in os.environ.items() if k not in ("ECDAQ_RUN_DIR", "LC_ALL", "LANG")}
    if run_dir is not None:
        kept["ECDAQ_RUN_DIR"] = str(run_dir)
    return kept | more


def ecdaq(
    run_dir: Path | None,
    *words: str,
    user: int | None = None,
    groups: Sequence[int] = (),
    **more: str,
) -> Result:
    """Run ecdaq to its end; as @user of @groups, if given."""
    return subprocess.run(
        [ECDAQ, *words],
        env=environment(run_dir, **more),
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        errors="surrogateescape",
        timeout=60,
        check=False,
        user=user,
        group=user,
        extra_groups=None if user is None else groups,
    )


def fails(result: Result, code: int, *message: str) -> None:
    """It ended with this code and one line on standard error with all of @message."""
    assert result.returncode == code, (result.returncode, result.stderr)
    assert result.stderr.startswith("ecdaq: ")
    assert result.stderr.count("\n") == 1 and result.stderr.endswith("\n"), result.stderr
    for text in message:
        assert text in result.stderr


def works(result: Result) -> str:
    assert result.returncode == OK, (result.returncode, result.stderr)
    assert result.stderr == ""
    return result.stdout


def json_of(result: Result) -> Any:
    """What it printed, which is one JSON value in one line."""
    text = works(result)
    assert text.count("\n") == 1 and text.endswith("\n")
    return json.loads(text)


def json_lines(result: Result) -> list[Any]:
    return [json.loads(line) for line in works(result).splitlines()]


def wait_until(what: Callable[[], bool], seconds: float = 60.0) -> None:
    """Poll until it is true."""
    deadline = time.monotonic() + seconds
    while not what():
        assert time.monotonic() < deadline, "waited in vain"
        time.sleep(0.005)


class Fake:
    """A fake ecdaqd in a run directory of its own; @how is a program that starts it."""

    def __init__(
        self, run_dir: Path, *settings: str, how: Sequence[str] = (), program: Path = FAKE
    ) -> None:
        self.run_dir = run_dir
        self.process = subprocess.Popen(
            [*how, program, run_dir, *settings],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        assert self.process.stdout is not None
        assert self.process.stdout.readline() == "ready\n"

    def __call__(
        self, *words: str, user: int | None = None, groups: Sequence[int] = (), **more: str
    ) -> Result:
        return ecdaq(self.run_dir, *words, user=user, groups=groups, **more)

    def start(self, *words: str, **options: Any) -> subprocess.Popen[str]:
        """Start ecdaq and leave it running."""
        return subprocess.Popen(
            [ECDAQ, *words], env=environment(self.run_dir), text=True, **options
        )

    @contextlib.contextmanager
    def held(self) -> Iterator[None]:
        """Stopped: what it shows stays as it is, however long a reader takes."""
        self.process.send_signal(signal.SIGSTOP)
        os.waitpid(self.process.pid, os.WUNTRACED)
        try:
            yield
        finally:
            self.process.send_signal(signal.SIGCONT)

    def sample(self, cycle: int, *channels: str) -> Any:
        """Raw values of a sample that is not older than @cycle."""
        found: list[Any] = []

        def is_there() -> bool:
            words = ["--count", "1", "--json", "--raw"]
            found.append(json_of(self("watch", *channels, *words)))
            return found[-1]["cycle"] >= cycle

        wait_until(is_there)
        return found[-1]

    def next_cycle(self) -> int:
        """No command that was answered before takes effect later."""
        number: int = json_of(self("status", "--json"))["cycle_number"]
        return number + 1

    def end(self) -> None:
        """Let it end in order."""
        assert self.process.stdin is not None
        self.process.stdin.close()
        assert self.process.wait(20) == 0

    def kill(self) -> None:
        self.process.kill()
        self.process.wait(20)

    def close(self) -> None:
        if self.process.poll() is None:
            self.kill()
        for stream in (self.process.stdin, self.process.stdout):
            if stream is not None:
                stream.close()
