# SPDX-License-Identifier: MIT
"""The segment is outside: frames leave the machine through its own port to ecdaq-sim on the host,
samples and commands go over DDS through its other port.

On the host's clock: this shows function, counts and content, not timing. The settings are wide
(app/tools/image/profile-host.yaml); every frame that is lost or late is counted, not excluded.
"""

from __future__ import annotations

import csv
import itertools
import json
import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from machine import TOP, Machine, Space, profile, wait_for

OUTSIDE = True
TIMING = "host"
DOMAIN = "7"
OP_S = 1200
SECONDS = 20
BIN = Path(os.environ.get("ECDAQ_BIN_DIR", TOP / "build" / "stage" / "bin"))
BUILD = Path(os.environ.get("ECDAQ_BUILD", TOP / "build" / "release"))
# The machine's port is the one that is not ecat0; udev calls it after its place on the bus.
LAN = "enp0s3"
# Ports of a second SSH server: the boot partition opens one.
OPENED, CLOSED = 2222, 2223
BOOT_FILES = {
    "ecdaq.yaml": profile("host")
    + f"""dds:
  enable: on
  interface: {LAN}
  domain: {DOMAIN}
  allow_insecure_commands: on
outputs:
  - channel: piccolo0.led
    owner: remote
    timeout: 30s
""",
    "time-servers": f"{Space.HOST}\n",
    "firewall": f"tcp {OPENED} {LAN}\n",
    "network/50-lan.network": f"[Match]\nName={LAN}\n[Network]\nAddress=192.168.77.2/24\n",
}


@pytest.fixture(scope="module", autouse=True)
def segment(machine: Machine) -> Iterator[subprocess.Popen[bytes]]:
    """ecdaq-sim at the other end of the machine's EtherCAT port."""
    assert machine.space is not None
    log = (machine.folder / "sim.log").open("wb")
    process = subprocess.Popen(
        [*machine.space.enter, BIN / "ecdaq-sim", "--interface", "ecat", "--slaves", "2"],
        stdout=log,
        stderr=log,
    )
    yield process
    process.terminate()
    process.wait(10)


@pytest.fixture(scope="module", autouse=True)
def time_server(machine: Machine) -> Iterator[None]:
    """The one that the boot partition names, on the host."""
    assert machine.space is not None
    program = [sys.executable, Path(__file__).parent / "time_server.py", Space.HOST]
    process = subprocess.Popen(
        [*machine.space.enter, *program], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    )
    assert process.stdin is not None and process.stdout is not None
    assert process.stdout.readline() == "ready\n"
    yield
    process.stdin.close()
    process.wait(10)


def test_the_bus_comes_to_op_through_the_port(machine: Machine) -> None:
    wait_for("OP", OP_S, lambda: machine.status().get("state") == "OP")
    found = machine.status()
    assert found["slaves"] == 2
    assert machine.run("readlink /sys/class/net/ecat0/device").strip()


def test_interrupts_of_the_port_are_on_the_core_of_the_cycle_above_it(machine: Machine) -> None:
    irqs = machine.run("/usr/lib/ecdaq/port-irqs ecat0").split()
    assert irqs
    for irq in irqs:
        assert machine.run(f"cat /proc/irq/{irq}/smp_affinity_list").strip() == "1"
        thread = machine.run(f"pgrep -x 'irq/{irq}-.*'").strip()
        message = machine.run(f"chrt --pid {thread}")
        assert "SCHED_FIFO" in message and "priority: 85" in message, message


def test_every_frame_is_accounted_for_and_the_recording_has_no_gap(machine: Machine) -> None:
    before = machine.status()
    machine.run(f"sleep {SECONDS}")
    after = machine.status()
    names = (
        *("cycles", "cycles_skipped", "frames_sent", "frames_lost", "frames_late", "overruns"),
        *("samples_good", "samples_bad", "samples_bad_unexplained"),
    )
    print(f"\nhost's clock, {SECONDS} s: { {n: after[n] - before[n] for n in names} }")
    print(f"round trip {after['round_trip_ns']}, wake {after['wake_latency_ns']}")
    assert after["cycles"] > before["cycles"]
    assert after["samples_bad_unexplained"] == 0
    assert after["recorded_gaps"] == 0
    # Each frame came back in its cycle, or is counted as lost.
    came = after["round_trip_ns"]["count"] + after["frames_lost"]
    assert abs(came - after["frames_sent"]) <= 1, after


def test_the_publisher_has_a_status_page_in_the_run_directory(machine: Machine) -> None:
    """It is another user than the master's, in a directory of their group."""
    wait_for("the publisher", 300, lambda: (machine.status()["dds"] or {}).get("running"))
    found = machine.status()["dds"]
    assert (found["domain"], found["interface"]) == (int(DOMAIN), LAN)


def gaps_of(path: Path) -> tuple[int, int]:
    """Of the C subscriber's file: samples, and gaps within each slave's cycles of one session."""
    cycles: dict[tuple[str, str], list[int]] = {}
    with path.open(newline="") as file:
        for row in csv.DictReader(file):
            cycles.setdefault((row["slave"], row["session"]), []).append(int(row["cycle"]))
    gaps = sum(b != a + 1 for c in cycles.values() for a, b in itertools.pairwise(sorted(c)))
    return sum(map(len, cycles.values())), gaps


def test_subscribers_on_the_host_miss_nothing_and_set_the_led(machine: Machine) -> None:
    assert machine.space is not None
    kit = str(BIN.parent / "share" / "ecdaq" / "python")
    program = [sys.executable, Path(__file__).parent / "pc.py", "lan", DOMAIN, str(SECONDS)]
    c_program = [BUILD / "tests/dds/dds_subscriber", DOMAIN, "lan", str(SECONDS)]
    c_file = machine.folder / "c.csv"
    in_c = subprocess.Popen([*machine.space.enter, *c_program, c_file])
    in_python = subprocess.run(
        [*machine.space.enter, *program],
        env=os.environ | {"PYTHONPATH": kit},
        capture_output=True,
        text=True,
        timeout=900,
        check=False,
    )
    assert in_c.wait(300) == 0
    errors = in_python.stderr.strip()
    assert in_python.returncode == 0, f"{errors.rpartition(chr(10))[2]}\n{errors}"
    found = json.loads(in_python.stdout)
    samples, gaps = gaps_of(c_file)
    print(f"\nPython: {found}\nC: {samples} samples, {gaps} gaps")
    assert found["samples"] > 100 and samples > 100
    assert (found["gaps"], found["doubled"], gaps) == (0, 0, 0)
    assert [step["seen"] for step in found["led"]] == [1, 0, 1]


def test_the_time_server_of_the_boot_partition_sets_the_clock_and_the_tai_offset(
    machine: Machine,
) -> None:
    """TAI is the clock of samples; the kernel knows its offset only once a server has answered."""
    # The server was not there at the boot, and chrony asks again after a minute.
    machine.run("sudo chronyc burst 4/4")
    machine.wait_until(
        "a time server is followed", "sudo chronyc -n tracking | grep -q 'Stratum.*: 2'"
    )

    def offset() -> bool:
        checks = machine.try_run("sudo ecdaq doctor --json").stdout
        found = {c["name"]: c for c in json.loads(checks)["check"]}
        return bool(found["tai"]["level"] == "OK")

    wait_for("TAI - UTC", 600, offset)


def test_a_port_that_nothing_opens_does_not_answer(machine: Machine) -> None:
    assert machine.space is not None
    machine.run(f"sudo /usr/sbin/sshd -p {OPENED} -p {CLOSED}")
    program = (
        "import socket\n"
        "closed = socket.socket(); closed.setblocking(False)\n"
        f"closed.connect_ex(('192.168.77.2', {CLOSED}))\n"
        f"for p in (22, {OPENED}):"
        " print(socket.create_connection(('192.168.77.2', p), 120).recv(4))\n"
        "print(closed.getsockopt(socket.SOL_SOCKET, socket.SO_ERROR))\n"
        "closed.recv(1)"
    )
    done = subprocess.run(
        [*machine.space.enter, sys.executable, "-c", program], capture_output=True, text=True
    )
    # Not refused and not connected: nothing came back.
    assert done.stdout.splitlines() == ["b'SSH-'", "b'SSH-'", "0"]
    assert "BlockingIOError" in done.stderr or "NotConnected" in done.stderr, done.stderr
