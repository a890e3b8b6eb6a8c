# SPDX-License-Identifier: MIT
"""Bundles for the machine under test, and the machine while it is updated."""

from __future__ import annotations

import http.server
import os
import re
import subprocess
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from machine import BOOT_S, TOOLS, Machine, wait_for
from write_log import SECTOR, copy_sparse

KEYS = Path(os.environ.get("XDG_CACHE_HOME", Path.home() / ".cache")) / "ecdaq/update-keys"
HOST = "10.0.2.2"
MINUTES = 1800.0
NEXT = "ecdaq-image-ecdaq-qemuarm64 0.1.1-next, Debian archive: 2026-01-01\n"


class Quiet(http.server.SimpleHTTPRequestHandler):
    """Its log would be part of a page of results."""

    def log_message(self, *_: object) -> None:
        pass


@dataclass
class Bundles:
    """Bundles, and a server of them that the machine reaches."""

    folder: Path
    port: int = 0

    def url(self, name: str) -> str:
        return f"http://{HOST}:{self.port}/{name}.raucb"

    def edit(self, slot: Path, *commands: str) -> None:
        """debugfs on a slot; files named in a command are in the folder."""
        for command in commands:
            tool = [TOOLS / "qemu.sh", self.folder, "debugfs", "-w", "-R", command, slot.name]
            subprocess.run(tool, check=True, capture_output=True)

    def make(self, name: str, slot: Path, key: str = "key", cert: str = "cert", **env: str) -> None:
        """folder/NAME.raucb of a slot."""
        out = self.folder / f"made-{name}"
        out.mkdir()
        keys = (KEYS / "key.pem", KEYS / "cert.pem")
        if key != "key":
            keys = (self.folder / key, self.folder / cert)
        done = subprocess.run(
            [TOOLS / "make-bundle.sh", "none", *keys, out],
            env=os.environ | {"ECDAQ_BUNDLE_SLOT": str(slot)} | env,
            check=True,
            capture_output=True,
            text=True,
        )
        os.rename(done.stdout.strip(), self.folder / f"{name}.raucb")

    def add_version(self, name: str, slot: Path, path: str, text: str, version: str) -> Path:
        """The bundle NAME.raucb: the slot with a file more and another version. What it holds."""
        copy = self.folder / f"slot-{name}"
        subprocess.run(["cp", "--sparse=always", slot, copy], check=True)
        (self.folder / "text").write_text(text)
        (self.folder / "image").write_text(NEXT.replace("0.1.1-next", version))
        self.edit(copy, f"mkdir {Path(path).parent}", f"rm {path}", f"write text {path}")
        self.edit(copy, "rm /usr/lib/ecdaq/image", "write image /usr/lib/ecdaq/image")
        self.make(name, copy)
        return copy

    @contextmanager
    def served(self) -> Iterator[None]:
        handler = partial(Quiet, directory=str(self.folder))
        with http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler) as server:
            self.port = server.server_address[1]
            threading.Thread(target=server.serve_forever, daemon=True).start()
            yield
            server.shutdown()


def slot_of(image: Path, machine: Machine, target: Path) -> Path:
    """The first slot of an image as a file of its own."""
    first, sectors = machine.partitions()["rootA"]
    copy_sparse(image, target, first * SECTOR, sectors * SECTOR)
    os.truncate(target, sectors * SECTOR)
    return target


def until_off(machine: Machine, seconds: float = BOOT_S) -> float:
    """Until the machine resets itself: its time at that, in seconds since the kernel's start."""
    process = machine.process
    assert process is not None
    wait_for("the reset", seconds, lambda: process.poll() is not None)
    machine.stop()
    times = re.findall(r"^\[ *(\d+\.\d+)\]", machine.console_of_this_boot(), re.MULTILINE)
    return float(times[-1]) if times else 0.0


def start(machine: Machine, slot: str) -> None:
    """Up to a start that is good, from this slot."""
    machine.start()
    machine.wait_for_login()
    machine.wait_until("SSH answers", "true", BOOT_S)
    machine.wait_until("the start is good", "systemctl is-active ecdaq-boot-good", MINUTES)
    stop_bus(machine)
    assert f"rauc.slot={slot}" in machine.run("cat /proc/cmdline").split()


def stop_bus(machine: Machine) -> None:
    """What follows is not about the bus, which takes ten times the guest's time to emulate."""
    machine.run("sudo systemctl stop ecdaqd ecdaq-record ecdaq-sync0 ecdaq-segment")


def restart(machine: Machine, command: str = "sudo systemctl --no-block reboot") -> None:
    machine.try_run(command)
    until_off(machine)


def running(machine: Machine) -> tuple[str, str]:
    """The slot that runs, and the other one."""
    words = machine.run("cat /proc/cmdline").split()
    slot = next(w.removeprefix("rauc.slot=") for w in words if w.startswith("rauc.slot="))
    return slot, "B" if slot == "A" else "A"


def state(machine: Machine) -> dict[str, str]:
    lines = machine.run("sudo fw_printenv").splitlines()
    return dict(line.split("=", 1) for line in lines if line.startswith("BOOT_"))


def own(machine: Machine) -> list[str]:
    """What a machine is known by, and what its user has written."""
    files = "/etc/machine-id /etc/ssh/ssh_host_ed25519_key.pub /var/home/operator/mine"
    return machine.run(
        f"hostname; cat {files}; ls /data/record | head -n 1 | cut -d . -f 1"
    ).splitlines()
