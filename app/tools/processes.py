# SPDX-License-Identifier: MIT
"""End what was started, with all that it started in turn."""

from __future__ import annotations

import contextlib
import ctypes
import os
import signal
import subprocess
import time
from pathlib import Path

PR_SET_CHILD_SUBREAPER = 36
TERM_SECONDS = 20


def adopt_orphans() -> None:
    """What loses its parent becomes a child of this process, whatever its session or group."""
    ctypes.CDLL(None).prctl(PR_SET_CHILD_SUBREAPER, 1, 0, 0, 0)


def descendants() -> list[int]:
    """All processes below this one, parents first."""
    children: dict[int, list[int]] = {}
    for stat in Path("/proc").glob("[0-9]*/stat"):
        with contextlib.suppress(OSError):
            fields = stat.read_text().rpartition(")")[2].split()
            children.setdefault(int(fields[1]), []).append(int(stat.parent.name))
    found = [os.getpid()]
    for pid in found:
        found += children.get(pid, [])
    return found[1:]


def wait_and_reap(process: subprocess.Popen[bytes], seconds: float) -> int:
    """As process.wait(seconds). Adopted orphans that end meanwhile are reaped, as init would: who
    waits for one of them to disappear must not wait for a zombie."""
    end = time.monotonic() + seconds
    while True:
        try:
            return process.wait(min(0.1, seconds))
        except subprocess.TimeoutExpired:
            reap_orphans(process.pid)
            if time.monotonic() > end:
                raise


def reap_orphans(keep: int) -> None:
    """Collect the children that have ended, but not @keep."""
    with contextlib.suppress(ChildProcessError):
        while True:
            ended = os.waitid(os.P_ALL, 0, os.WEXITED | os.WNOHANG | os.WNOWAIT)
            if ended is None or ended.si_pid == keep:
                return
            os.waitpid(ended.si_pid, os.WNOHANG)


def end_group(process: subprocess.Popen[bytes]) -> None:
    """End a suite, the leader of a process group, and then whatever of it is left."""
    with contextlib.suppress(ProcessLookupError):
        os.killpg(process.pid, signal.SIGTERM)
    with contextlib.suppress(subprocess.TimeoutExpired):
        process.wait(TERM_SECONDS)
    for number in (signal.SIGTERM, signal.SIGKILL):
        signal_descendants(number)
    process.wait()


def signal_descendants(number: signal.Signals) -> None:
    """Send @number to all descendants and give them two seconds."""
    for pid in descendants():
        with contextlib.suppress(ProcessLookupError):
            os.kill(pid, number)
    end = time.monotonic() + 2
    while descendants() and time.monotonic() < end:
        with contextlib.suppress(ChildProcessError):
            while os.waitpid(-1, os.WNOHANG)[0] != 0:
                pass
        time.sleep(0.02)
