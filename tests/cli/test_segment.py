# SPDX-License-Identifier: MIT
"""The command line of ecdaq-sim: what goes wrong before there is a segment, one line each."""

from __future__ import annotations

import os
import signal
import socket
import subprocess
import time
from collections.abc import Sequence
from pathlib import Path

import pytest
from ecdaq import BIN, ROOT, Result, environment

SEGMENT = BIN / "ecdaq-sim"
FAILED, USAGE = 1, 2
# The loopback interface takes a packet socket like any other; no master is needed here.
NIC = ["--interface", "lo"]
# With the loopback interface of a network of its own, to which nobody else sends frames.
OWN_NETWORK = ["unshare", "--net", "sh", "-c", 'ip link set lo up; exec "$0" "$@"', SEGMENT, *NIC]

MISTAKES = [
    (USAGE, [], "--interface is missing"),
    (FAILED, ["--interface", "nosuchnic"], "nosuchnic: no such interface"),
    (FAILED, [*NIC, "--slaves", "0"], "expected a number from 1 to 512"),
    (FAILED, [*NIC, "--slaves", "513"], "expected a number from 1 to 512"),
    (USAGE, [*NIC, "--slaves", ""], "missing value"),
    (FAILED, [*NIC, "--slaves", "a/b"], "--slaves: expected the name of a slave at 'a/b'"),
    (FAILED, [*NIC, "--slaves", "ek1100(el2828"], "--slaves: ')' is missing"),
    (FAILED, [*NIC, "--slaves", "el2828(2:el2828)"], "port 2 of el2828 is not there"),
    (FAILED, [*NIC, "--slaves", "el2829"], "'el2829': not in the catalogue: did you mean el2828"),
    (FAILED, [*NIC, "--slaves", "motor"], "'motor': not in the catalogue: --list-slaves"),
    (FAILED, [*NIC, "--slaves", "el", "--sii", "/tmp"], "'el': not in the catalogue nor in /tmp"),
    (FAILED, [*NIC, "--slaves", "plant:0"], "expected plant[:TAU_MS[:GAIN]]"),
    (FAILED, [*NIC, "--slaves", "plant:50:nan"], "expected plant[:TAU_MS[:GAIN]]"),
    (FAILED, [*NIC, "--slaves", "plant:50:1:"], "expected plant[:TAU_MS[:GAIN]]"),
    (FAILED, [*NIC, "--slaves", "wago_750_354+431"], "'wago_750_354+431': expected wago_750_354"),
    (FAILED, [*NIC, "--slaves", "wago_750_354+"], "'wago_750_354+': expected wago_750_354"),
    (FAILED, [*NIC, "--ppm", "1,x"], "--ppm"),
    (FAILED, [*NIC, "--ppm", "1,2,3"], "more numbers than slaves"),
    (FAILED, [*NIC, "--ppm", "nan"], "--ppm"),
    (USAGE, [*NIC, "--jitter", "-1"], "--jitter"),
    (USAGE, [*NIC, "--wander", "inf"], "--wander"),
    (USAGE, [*NIC, "--signal", "square"], "--signal"),
    (USAGE, [*NIC, "--seed", "many"], "--seed"),
    (USAGE, [*NIC, "--edges-keep", "0"], "--edges-keep"),
    (FAILED, [*NIC, "--edges", "/nonexistent/edges"], "/nonexistent/edges: No such file"),
    (USAGE, [*NIC, "--priority", "100"], "--priority"),
    (FAILED, [*NIC, "--faults", "/nonexistent"], "/nonexistent: No such file"),
    (USAGE, [*NIC, "word"], "unexpected argument"),
]


def segment(*words: str | Path, how: Sequence[str | Path] = (SEGMENT,)) -> Result:
    return subprocess.run(
        [*how, *words],
        env=environment(None),
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )


def one_line(stderr: str) -> str:
    assert stderr.startswith("ecdaq-sim: "), stderr
    assert stderr.count("\n") == 1, stderr
    return stderr


@pytest.mark.parametrize(("code", "words", "message"), MISTAKES)
def test_a_mistake_is_one_line(code: int, words: list[str], message: str) -> None:
    result = segment(*words)
    assert result.returncode == code, result.stderr
    assert message in one_line(result.stderr)
    assert result.stdout == ""


def test_help_names_every_option_and_every_fault() -> None:
    result = segment("--help")
    assert result.returncode == 0
    for option in ("interface", "slaves", "sii", "ppm", "wander", "jitter", "signal", "seed"):
        assert f"--{option} " in result.stdout
    for option in ("faults", "control", "edges", "edges-keep", "priority", "cpu"):
        assert f"--{option} " in result.stdout
    for fault in ("lose", "hold", "damage", "power-off", "mailbox-stuck", "identity"):
        assert fault in result.stdout
    assert "exit codes" in result.stdout


@pytest.mark.parametrize("length", [0, 127])
def test_a_file_that_is_no_image_is_refused(tmp_path: Path, length: int) -> None:
    (tmp_path / "short.bin").write_bytes(b"\0" * length)
    result = segment(*NIC, "--sii", str(tmp_path), "--slaves", "short")
    assert result.returncode == FAILED
    assert f"short.bin: not an SII image: {length} bytes" in one_line(result.stderr)


def test_an_image_larger_than_any_eeprom_is_refused(tmp_path: Path) -> None:
    (tmp_path / "big.bin").write_bytes(b"\xff" * 65537)
    result = segment(*NIC, "--sii", str(tmp_path), "--slaves", "big")
    assert result.returncode == FAILED
    assert "big.bin: File too large" in one_line(result.stderr)


def test_a_fault_plan_names_the_line_of_its_mistake(tmp_path: Path) -> None:
    plan = tmp_path / "plan"
    plan.write_text("# fine\nat=1s lose\nat=2s bogus\n")
    result = segment(*NIC, "--faults", str(plan))
    assert result.returncode == FAILED
    assert f"{plan}:3: " in one_line(result.stderr)


def ask(path: Path, here: Path, line: str) -> str:
    """One line to the control socket, and its answer."""
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as s:
        s.bind(str(here))
        s.settimeout(60)
        s.sendto(line.encode(), str(path))
        answer = s.recv(300).decode()
    here.unlink()
    return answer


@pytest.mark.skipif(os.geteuid() != 0, reason="a packet socket needs CAP_NET_RAW")
def test_it_takes_faults_while_it_runs_and_ends_with_a_summary(run_dir: Path) -> None:
    control = run_dir / "control"
    with subprocess.Popen(
        [*OWN_NETWORK, "--control", control], stderr=subprocess.PIPE, text=True
    ) as running:
        wait_for(control)
        assert ask(control, run_dir / "me", "at=1s cut slave=1") == "ok"
        assert "slave" in ask(control, run_dir / "me", "at=1s cut slave=2")
        assert "unknown fault" in ask(control, run_dir / "me", "at=1s bogus")
        running.send_signal(signal.SIGTERM)
        _, stderr = running.communicate(timeout=60)
    assert running.returncode == 0
    assert one_line(stderr) == "ecdaq-sim: 0 frames, 0 damaged\n"
    assert not control.exists()


@pytest.mark.skipif(os.geteuid() != 0, reason="a packet socket needs CAP_NET_RAW")
def test_io_lines_reach_the_terminals_while_it_runs(run_dir: Path) -> None:
    control = run_dir / "control"
    slaves = ["--slaves", "wago_750_354,wago_750_354+530,fb1111_piccolo"]
    with subprocess.Popen([*OWN_NETWORK, *slaves, "--control", control]) as running:
        wait_for(control)
        for line, answer in (
            ("io slave=0", "slot1=0,0,0,0 slot2=0,0,0,0 slot3=0x00 slot4=0x00"),
            ("io slave=1", "slot1=0x00"),
            ("io slave=2", "led=0"),
            ("io slave=3", "io: slave=N is missing, or no such slave"),
            ("io slave=0 slot3.9=1", "slot3.9=1: unknown input or invalid value"),
            ("io slave=2 led=1", "led=1: unknown input or invalid value"),
        ):
            assert ask(control, run_dir / "me", line) == answer
        tool = [ROOT / "app" / "tools" / "tell-segment.py", "--control", control]
        message = subprocess.run(
            [*tool, "io", "slave=1"], capture_output=True, text=True, check=True
        )
        assert message.stdout == "slot1=0x00\n"
        running.send_signal(signal.SIGTERM)
        assert running.wait(60) == 0
    gone = subprocess.run([*tool, "io slave=1"], capture_output=True, text=True, check=False)
    assert gone.returncode == FAILED
    assert gone.stderr == f"tell-segment: {control}: No such file or directory\n"


@pytest.mark.skipif(os.geteuid() != 0, reason="a packet socket needs CAP_NET_RAW")
def test_a_control_socket_in_use_is_left_alone(run_dir: Path) -> None:
    control = run_dir / "control"
    with subprocess.Popen(
        [*OWN_NETWORK, "--control", control], stderr=subprocess.PIPE, text=True
    ) as running:
        wait_for(control)
        second = segment("--control", control, how=OWN_NETWORK)
        assert second.returncode == FAILED
        assert f"--control {control}: Address already in use" in one_line(second.stderr)
        assert ask(control, run_dir / "me", "at=1s cut slave=1") == "ok"
        running.send_signal(signal.SIGTERM)
        running.communicate(timeout=60)
    assert running.returncode == 0


def wait_for(path: Path) -> None:
    until = time.monotonic() + 60
    while not path.exists():
        assert time.monotonic() < until, path
        time.sleep(0.01)


def test_the_catalogue_page_has_the_table_that_the_program_prints() -> None:
    result = segment("--list-slaves")
    assert result.returncode == 0
    assert result.stdout.count("\n| el") >= 15
    assert result.stdout in (ROOT / "app/doc/reference/simulated-slaves.md").read_text()


def test_a_real_image_is_used_instead_of_the_catalogue(tmp_path: Path) -> None:
    (tmp_path / "ek1100.bin").write_bytes(b"\0" * 5)
    result = segment(*NIC, "--sii", str(tmp_path), "--slaves", "el2828,ek1100")
    assert result.returncode == FAILED
    assert "ek1100.bin: not an SII image: 5 bytes" in one_line(result.stderr)
