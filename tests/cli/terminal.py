# SPDX-License-Identifier: MIT
"""A pseudo terminal with ecdaq or a shell on it, and what was drawn there."""

from __future__ import annotations

import codecs
import fcntl
import os
import pty
import re
import select
import signal
import struct
import subprocess
import termios
import time
from collections.abc import Callable, Sequence
from pathlib import Path

from ecdaq import ECDAQ, ROOT, Fake, environment

ENTER, LEAVE = "\x1b[?1049h", "\x1b[?1049l"


def own_terminal() -> None:
    """In a child: a session of its own, with standard input as its terminal."""
    os.setsid()
    fcntl.ioctl(0, termios.TIOCSCTTY, 0)


class Terminal:
    """A pseudo terminal with a program on it."""

    def __init__(self, rows: int, columns: int) -> None:
        self.master, self.slave = pty.openpty()
        fcntl.ioctl(self.slave, termios.TIOCSWINSZ, struct.pack("HHHH", rows, columns, 0, 0))
        self.before = termios.tcgetattr(self.slave)
        self.text = ""
        # A read may end within a character.
        self.decoder = codecs.getincrementaldecoder("utf-8")(errors="replace")
        self.process: subprocess.Popen[bytes] | None = None

    def resize(self, rows: int, columns: int) -> None:
        """As the window does: the program on it gets SIGWINCH."""
        fcntl.ioctl(self.slave, termios.TIOCSWINSZ, struct.pack("HHHH", rows, columns, 0, 0))
        if self.process is not None:
            self.process.send_signal(signal.SIGWINCH)

    def start(self, daemon: Fake, *words: str, cwd: str | None = None, **more: str) -> None:
        self.process = subprocess.Popen(
            [ECDAQ, *words],
            env=environment(daemon.run_dir, LANG="C.UTF-8", **more),
            stdin=self.slave,
            stdout=self.slave,
            stderr=subprocess.PIPE,
            cwd=cwd,
        )

    def start_on(self, words: Sequence[str | Path]) -> None:
        """ecdaq without an ecdaqd, its standard error on the terminal, too."""
        self.process = subprocess.Popen(
            [ECDAQ, *words],
            env=environment(None, LANG="C.UTF-8"),
            stdin=self.slave,
            stdout=self.slave,
            stderr=self.slave,
        )

    def start_shell(self, run_dir: Path, **more: str) -> None:
        """An interactive shell with job control; its prompt is "READY> "."""
        self.process = subprocess.Popen(
            ["bash", "--norc", "--noprofile", "--noediting", "-i"],
            env=environment(run_dir, LANG="C.UTF-8", PS1="READY> ", **more),
            stdin=self.slave,
            stdout=self.slave,
            stderr=self.slave,
            preexec_fn=own_terminal,
            cwd=ROOT,
        )
        self.wait_for("READY> ")

    def wait_for_new(self, pattern: str) -> str:
        """Wait for @pattern in what comes from now on."""
        self.text = ""
        self.wait_for(pattern)
        return self.text

    def has_keys(self) -> bool:
        """Are keys given one by one, without echo?"""
        return termios.tcgetattr(self.slave)[3] & (termios.ICANON | termios.ECHO) == 0

    def read_some(self) -> bool:
        if not select.select([self.master], [], [], 0.05)[0]:
            return False
        self.text += self.decoder.decode(os.read(self.master, 65536))
        return True

    def wait_until(self, condition: Callable[[], bool]) -> None:
        """Of what was drawn."""
        deadline = time.monotonic() + 60
        while not condition():
            assert time.monotonic() < deadline, self.text[-2000:]
            self.read_some()

    def wait_for(self, pattern: str) -> None:
        self.wait_until(lambda: re.search(pattern, self.text) is not None)

    def press(self, keys: str) -> None:
        os.write(self.master, keys.encode())

    def end(self) -> tuple[int, str]:
        """Wait for the program's end: its exit code and standard error."""
        assert self.process is not None and self.process.stderr is not None
        deadline = time.monotonic() + 60
        while self.process.poll() is None:
            assert time.monotonic() < deadline
            self.read_some()
        while self.read_some():
            pass
        return self.process.returncode, self.process.stderr.read().decode()

    def is_restored(self) -> bool:
        left = self.text.rfind(LEAVE) > self.text.rfind(ENTER) >= 0
        return left and termios.tcgetattr(self.slave) == self.before

    def close(self) -> None:
        if self.process is not None:
            self.process.kill()
            self.process.wait(20)
            if self.process.stderr is not None:
                self.process.stderr.close()
        os.close(self.master)
        os.close(self.slave)


def screens(text: str) -> list[list[str]]:
    """What was drawn, frame by frame, without the sequences."""
    frames = text.split("\x1b[H")[1:]
    plain = [re.sub(r"\x1b\[[0-9;?]*[A-Za-z]|\r", "", frame) for frame in frames]
    return [frame.split("\n") for frame in plain]
