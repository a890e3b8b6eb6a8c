# SPDX-License-Identifier: MIT
"""A network with DHCP gives the machine its address, its name server and its time server; no file
on the boot partition names any of them. On the host's clock: time is what is tested."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from machine import Machine, Space, profile, wait_for

OUTSIDE = True
TIMING = "host"
BOOT_FILES = {"ecdaq.yaml": profile("host")}
# The clock chip has forgotten the time.
START = {"options": ("-rtc", "base=2001-02-03")}
NAME = "logger.plant.example"
# chronyd asks four times before it sets the clock; an emulator is slow.
MINUTES = 900
CLOCK_ERROR_S = 30

pytestmark = pytest.mark.skipif(not shutil.which("dnsmasq"), reason="no dnsmasq here")


@contextmanager
def beside(space: Space) -> Iterator[None]:
    """What a plant's network has: dnsmasq for DHCP and names, and a time server."""
    options = (
        *("--keep-in-foreground", "--conf-file=/dev/null", "--user=root", "--pid-file="),
        *("--no-resolv", "--no-hosts", "--bind-interfaces", "--interface=lan"),
        *("--leasefile-ro", f"--dhcp-range={Space.GUEST},{Space.GUEST},1h"),
        *(f"--dhcp-option=option:ntp-server,{Space.HOST}", f"--address=/{NAME}/{Space.HOST}"),
    )
    names = subprocess.Popen([*space.enter, "dnsmasq", *options])
    program = [sys.executable, str(Path(__file__).parent / "time_server.py"), Space.HOST]
    clock = subprocess.Popen(
        [*space.enter, *program], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    )
    assert clock.stdin is not None and clock.stdout is not None
    assert clock.stdout.readline() == "ready\n"
    yield
    clock.stdin.close()
    clock.wait(10)
    assert names.poll() is None, "dnsmasq has ended"
    names.terminate()
    names.wait(10)


def ntp_level(machine: Machine) -> str:
    found = json.loads(machine.try_run("ecdaq doctor --json").stdout)["check"]
    return next(str(check["level"]) for check in found if check["name"] == "ntp")


def test_names_are_resolved_by_the_server_that_dhcp_names(machine: Machine) -> None:
    machine.wait_until("a name server", f"grep -q '^nameserver {Space.HOST}$' /etc/resolv.conf")
    assert machine.run(f"getent ahostsv4 {NAME}").split()[0] == Space.HOST


def test_the_clock_is_set_by_the_server_that_dhcp_names(machine: Machine) -> None:
    chosen = f"sudo chronyc -n sources | grep -qF '^* {Space.HOST} '"
    machine.wait_until("a time server that is followed", chosen, MINUTES)
    apart = abs(float(machine.run("date +%s")) - time.time())
    assert apart < CLOCK_ERROR_S
    wait_for("doctor's OK", MINUTES, lambda: ntp_level(machine) == "OK")
    print(f"\n{machine.run('sudo chronyc -n sources')}")
