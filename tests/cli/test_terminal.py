# SPDX-License-Identifier: MIT
"""The live screens of ecdaq on a terminal of their own."""

from __future__ import annotations

import fcntl
import os
import re
import signal
import struct
import subprocess
import sys
import termios
from collections.abc import Callable
from pathlib import Path

import pytest
from ecdaq import ECDAQ, FAKE, NO_DAEMON, OK, ROOT, Fake, environment, wait_until
from terminal import ENTER, LEAVE, Terminal, screens

# Stand-ins for what `./build.sh run` starts; the view is the real one.
DAEMON = """#!/bin/sh
mkfifo "$ECDAQ_RUN_DIR/never"
exec {fake} "$ECDAQ_RUN_DIR" SPEED=10 <> "$ECDAQ_RUN_DIR/never"
"""
OTHER = """#!/bin/sh
exec sleep infinity
"""


def test_top_redraws_periodically_and_ends_with_q(daemon: Fake, terminal: Terminal) -> None:
    terminal.start(daemon, "top", "--interval", "20ms")
    terminal.wait_for(r"(?s)(\x1b\[H.*){4}")

    def cycles() -> list[int]:
        """In the screens that are complete."""
        text = ["\n".join(screen) for screen in screens(terminal.text)[:-1]]
        found = [re.search(r"cycle +(\d+)", one) for one in text]
        assert all(found)
        return [int(one.group(1)) for one in found if one]

    # In the fourth screen already, unless ecdaqd does not run for a while.
    terminal.wait_until(lambda: cycles()[-1] > cycles()[0])
    terminal.press("q")
    assert terminal.end() == (OK, "")
    assert terminal.is_restored()
    assert cycles() == sorted(cycles())
    for screen in screens(terminal.text)[:4]:
        assert len(screen) <= 24 and all(len(line) <= 90 for line in screen)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_a_signal_leaves_the_terminal_as_it_was(
    daemon: Fake, terminal: Terminal, number: signal.Signals
) -> None:
    terminal.start(daemon, "top")
    terminal.wait_for("piccolo1")
    assert terminal.process is not None
    terminal.process.send_signal(number)
    assert terminal.end() == (OK, "")
    assert terminal.is_restored()


def test_top_ends_with_ecdaqd_and_leaves_the_last_state(daemon: Fake, terminal: Terminal) -> None:
    terminal.start(daemon, "top", "--interval", "20ms")
    terminal.wait_for("piccolo1")
    daemon.end()
    assert terminal.end() == (OK, "")
    assert terminal.is_restored()
    assert "STOPPED" in terminal.text[terminal.text.rfind(LEAVE) :]


def test_the_last_lines_explain_q_and_the_command_for_a_second_terminal(
    daemon: Fake, terminal: Terminal
) -> None:
    fcntl.ioctl(terminal.slave, termios.TIOCSWINSZ, struct.pack("HHHH", 8, 400, 0, 0))
    terminal.start(daemon, "top", "--interval", "20ms", "--leave-text", "q: stop it all")
    terminal.wait_for(r"(?s)(\x1b\[H.*){4}")
    frame = screens(terminal.text)[1]
    terminal.press("q")
    assert terminal.end() == (OK, "")
    # Eight rows are too few for the status: the last lines are there all the same.
    assert len(frame) == 8
    assert frame[-2] == "q: stop it all   Ctrl-Z: suspend   ?: keys   rows 1-1 of 2"
    label, _, command = frame[-1].partition(": ")
    assert label == "2nd terminal"
    assert f"--run-dir {daemon.run_dir} status" in command
    message = subprocess.run(
        command, shell=True, env=environment(None), capture_output=True, text=True, check=True
    )
    assert "2 slaves" in message.stdout and not message.stderr


@pytest.mark.parametrize("missing", [0, 1])
def test_the_line_for_a_second_terminal_wraps_between_words(
    daemon: Fake, terminal: Terminal, missing: int
) -> None:
    command = f"--run-dir {daemon.run_dir} status"
    name = ECDAQ.resolve()
    width = len(f"2nd terminal: {name} {command}")
    fcntl.ioctl(terminal.slave, termios.TIOCSWINSZ, struct.pack("HHHH", 24, width - missing, 0, 0))
    terminal.start(daemon, "top", "--interval", "20ms", cwd="/")
    terminal.wait_for(r"(?s)(\x1b\[H.*){4}")
    frame = screens(terminal.text)[1]
    terminal.press("q")
    assert terminal.end() == (OK, "")
    if missing:
        assert frame[-2:] == [f"2nd terminal: {name} \\", f"  {command}"]
    else:
        assert frame[-1] == f"2nd terminal: {name} {command}"


def state_of(pid: str) -> str:
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0]
    except (FileNotFoundError, ProcessLookupError):  # the second while it is read
        return "gone"


def test_a_view_in_the_background_stops_and_ends_without_the_foreground(
    daemon: Fake, terminal: Terminal
) -> None:
    terminal.start_shell(daemon.run_dir)
    terminal.press(f"{ECDAQ} top --interval 20ms\n")
    terminal.wait_for_new(r"(?s)\x1b\[\?1049h.*\x1b\[H")
    terminal.press("\x1a")
    terminal.wait_for_new(r"(?s)Stopped.*READY> ")
    terminal.press("jobs -l\n")
    found = re.search(r"\[1\]\+ +(\d+) Stopped", terminal.wait_for_new(r"(?s)Stopped.*READY> "))
    assert found
    terminal.press("bg\n")
    terminal.wait_for_new("READY> ")
    wait_until(lambda: state_of(found.group(1)) == "T")
    assert not terminal.has_keys()
    terminal.press("kill %1\n")
    terminal.wait_for_new("READY> ")
    wait_until(lambda: state_of(found.group(1)) in ("Z", "gone"))
    assert not terminal.has_keys()


@pytest.mark.parametrize("verb", ["top --interval 20ms", "watch piccolo1.adc --plot"])
def test_ctrl_z_gives_the_terminal_back_and_fg_resumes_the_view(
    daemon: Fake, terminal: Terminal, verb: str
) -> None:
    terminal.start_shell(daemon.run_dir)
    for _ in range(2):
        terminal.press(f"{ECDAQ} {verb}\n" if ENTER not in terminal.text else "fg\n")
        terminal.wait_for_new(r"(?s)\x1b\[\?1049h.*(\x1b\[H.*){3}")
        assert terminal.has_keys()
        terminal.press("\x1a")
        text = terminal.wait_for_new(r"(?s)Stopped.*READY> ")
        assert text.rfind(LEAVE) > text.rfind("\x1b[H")
        assert not terminal.has_keys()
        terminal.text = ENTER
    # It is stopped, not only silent.
    terminal.press("jobs -l\n")
    state = re.search(r"\[1\]\+ +(\d+) Stopped", terminal.wait_for_new(r"(?s)Stopped.*READY> "))
    assert state and " T " in Path(f"/proc/{state.group(1)}/stat").read_text()
    terminal.press("fg\n")
    terminal.wait_for_new(r"(?s)\x1b\[\?1049h.*(\x1b\[H.*){3}")
    terminal.press("q")
    text = terminal.wait_for_new("READY> ")
    assert text.rfind(LEAVE) >= 0 and not terminal.has_keys()


def test_a_stop_that_cannot_be_caught_is_repaired_by_sigcont(
    daemon: Fake, terminal: Terminal
) -> None:
    terminal.start(daemon, "top", "--interval", "10s")
    terminal.wait_for("piccolo1")
    assert terminal.process is not None
    terminal.process.send_signal(signal.SIGSTOP)
    os.waitpid(terminal.process.pid, os.WUNTRACED)
    termios.tcsetattr(terminal.slave, termios.TCSANOW, terminal.before)
    terminal.process.send_signal(signal.SIGCONT)
    terminal.wait_for_new(r"(?s)\x1b\[\?1049h.*piccolo1")
    assert terminal.has_keys()
    terminal.press("q")
    assert terminal.end() == (OK, "")
    assert termios.tcgetattr(terminal.slave) == terminal.before


@pytest.mark.skipif(os.geteuid() != 0, reason="makes a network namespace, which takes root")
def test_a_run_is_suspended_with_its_view_and_q_ends_it(
    run_dir: Path, tmp_path: Path, terminal: Terminal
) -> None:
    for name in ("ecdaqd", "ecdaq-record", "ecdaq-sim"):
        program = tmp_path / name
        program.write_text(DAEMON.format(fake=FAKE) if name == "ecdaqd" else OTHER)
        program.chmod(0o755)
    (tmp_path / "ecdaq").symlink_to(ECDAQ)
    script = f"{ROOT}/app/tools/run-segment.sh --no-dds --record {tmp_path}/record"
    terminal.start_shell(run_dir, ECDAQ_BIN_DIR=str(tmp_path))
    terminal.press(f"{script}\n")
    for _ in range(2):
        terminal.wait_for_new(r"(?s)\x1b\[\?1049h.*q: stop master, segment and recorder.*\x1b\[H")
        terminal.press("\x1a")
        text = terminal.wait_for_new(r"(?s)Stopped.*READY> ")
        assert not terminal.has_keys()
        # The terminal was given back before the shell took it: nothing is drawn behind the prompt.
        assert text.rfind(LEAVE) > text.rfind("\x1b[H") and LEAVE not in text.split("Stopped")[1]
        terminal.press("fg\n")
    terminal.wait_for_new(r"(?s)\x1b\[\?1049h.*(\x1b\[H.*){2}")
    assert terminal.has_keys()
    terminal.press("q")
    text = terminal.wait_for_new("READY> ")
    assert "2 slaves" in text[text.rfind(LEAVE) :] and not terminal.has_keys()


# A view that takes its time to stop, as the real one does on a slow machine.
SLOW_VIEW = """#!{python}
import os, signal, sys, time
if sys.argv[1] != "top":
    os.execv("{ecdaq}", ["ecdaq", *sys.argv[1:]])
KEYS = {{signal.SIGTSTP, signal.SIGINT}}
# Blocked: a key between two statements waits for sigwait(), where a handler would miss it.
signal.pthread_sigmask(signal.SIG_BLOCK, KEYS)
print("view runs", flush=True)
while signal.sigwait(KEYS) == signal.SIGTSTP:
    time.sleep(1)
    print("view stops", flush=True)
    os.kill(os.getpid(), signal.SIGSTOP)
    print("view continues", flush=True)
"""


@pytest.mark.skipif(os.geteuid() != 0, reason="makes a network namespace, which takes root")
def test_a_view_that_stops_late_suspends_the_run_as_well(
    run_dir: Path, tmp_path: Path, terminal: Terminal
) -> None:
    for name in ("ecdaqd", "ecdaq-record", "ecdaq-sim"):
        (tmp_path / name).write_text(OTHER)
        (tmp_path / name).chmod(0o755)
    (tmp_path / "ecdaq").write_text(SLOW_VIEW.format(ecdaq=ECDAQ, python=sys.executable))
    (tmp_path / "ecdaq").chmod(0o755)
    script = f"{ROOT}/app/tools/run-segment.sh --no-dds --record {tmp_path}/record"
    terminal.start_shell(run_dir, ECDAQ_BIN_DIR=str(tmp_path))
    terminal.press(f"{script}\n")
    terminal.wait_for_new("view runs")
    for _ in range(2):
        # A second key must not stop a command that the script waits for.
        terminal.press("\x1a")
        terminal.press("\x1a")
        text = terminal.wait_for_new(r"(?s)Stopped.*READY> ")
        assert "view stops" in text.split("Stopped")[0]
        terminal.press("fg\n")
        terminal.wait_for_new("view continues")
    terminal.press("\x03")
    terminal.wait_for_new("READY> ")


def test_a_live_plot_starts_full_and_scrolls(daemon: Fake, terminal: Terminal) -> None:
    terminal.start(daemon, "watch", "piccolo1.adc", "--plot", "--window", "1s")
    terminal.wait_for(r"(?s)(\x1b\[H.*){4}")

    def has_scrolled() -> bool:
        _, first, *others = screens(terminal.text)[:-1]
        return any(frame[1:20] != first[1:20] for frame in others)

    # In the next frame already, unless ecdaqd does not run for a while.
    terminal.wait_until(has_scrolled)
    terminal.press("q")
    assert terminal.end() == (OK, "")
    assert terminal.is_restored()
    frames = screens(terminal.text[: terminal.text.rfind(LEAVE)])
    # A second of samples was in the ring: a whole period of the sine is seen at once.
    assert re.match(r"piccolo1\.adc   now \d+   min 62\d   max 186\d$", frames[1][0])
    assert any("\u2801" <= c <= "\u28ff" for line in frames[1] for c in line)
    assert all(len(frame) <= 24 for frame in frames)


def test_a_small_terminal_is_supported(daemon: Fake, terminal: Terminal) -> None:
    fcntl.ioctl(terminal.slave, termios.TIOCSWINSZ, struct.pack("HHHH", 3, 10, 0, 0))
    terminal.start(daemon, "watch", "piccolo*", "--plot")
    terminal.wait_for(r"(?s)(\x1b\[H.*){2}")
    terminal.press("q")
    assert terminal.end() == (OK, "")
    for frame in screens(terminal.text)[:1]:
        assert len(frame) <= 3 and all(len(line) <= 10 for line in frame)


def test_without_ecdaqd_the_terminal_is_unchanged(daemon: Fake, terminal: Terminal) -> None:
    daemon.end()
    (daemon.run_dir / "status").unlink()
    terminal.start(daemon, "top", "--wait", "50ms")
    code, message = terminal.end()
    assert code == NO_DAEMON and message.startswith("ecdaq: top: ")
    assert ENTER not in terminal.text


def test_top_waits_for_an_ecdaqd_that_is_starting(
    fake: Callable[..., Fake], terminal: Terminal
) -> None:
    """What an ecdaqd of yesterday has left does not count."""
    before = fake()
    before.end()
    terminal.start(before, "top", "--interval", "20ms")
    terminal.wait_for("waiting for ecdaqd in")
    fake()
    terminal.wait_for("piccolo1")
    assert "STOPPED" not in terminal.text
    terminal.press("q")
    assert terminal.end() == (OK, "")
