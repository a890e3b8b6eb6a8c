# SPDX-License-Identifier: MIT
"""The image in QEMU, driven by tests: every wait names what it waits for and how long."""

from __future__ import annotations

import json
import os
import re
import shutil
import signal
import socket
import subprocess
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

TOP = Path(__file__).resolve().parents[2]
IMAGE = TOP / "build" / "image" / "qemuarm64"
NAME = "ecdaq-image-ecdaq-qemuarm64"
QEMU_SH = TOP / "app" / "tools" / "image" / "qemu.sh"
# An emulator on a busy machine: limits that only a hang exceeds.
BOOT_S = float(os.environ.get("ECDAQ_BOOT_SECONDS", "300"))
POLL_S = 0.2
ANSI = re.compile(r"\x1b\[[0-9;?]*[A-Za-z]|\r")


class WaitError(AssertionError):
    """What was waited for did not come."""


def wait_for(what: str, seconds: float, probe: Callable[[], Any]) -> Any:
    """Ask `probe` until it gives something true; WaitError names what was waited for."""
    until = time.monotonic() + seconds
    while True:
        result = probe()
        if result:
            return result
        if time.monotonic() > until:
            raise WaitError(f"{what}: not within {seconds:.0f} s")
        time.sleep(POLL_S)


def free_port() -> int:
    """A TCP port of the loopback address that nobody has."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


class Machine:
    """One virtual machine with a disk of its own, made from the image."""

    def __init__(self, folder: Path, image: Path, key: Path) -> None:
        self.folder = folder
        self.key = key
        self.disk = folder / "disk.img"
        subprocess.run(["cp", "--sparse=always", image, self.disk], check=True)
        # The data partition has to grow into what the image does not have.
        with self.disk.open("r+b") as disk:
            disk.truncate(2 << 30)
        shutil.copy(IMAGE / f"{NAME}-vmlinux", folder / "vmlinux")
        self.cmdline = (IMAGE / f"{NAME}.cmdline").read_text().strip()
        self.port = free_port()
        self.process: subprocess.Popen[bytes] | None = None
        self.boots = 0
        # What the processor emulation is told; see test_20_segment.py for guest time.
        self.accelerator = ["-accel", "tcg,thread=multi"]

    def tool(self, *command: str | Path) -> subprocess.CompletedProcess[str]:
        """A program of the SDK chroot, in the folder of this machine."""
        return subprocess.run(
            [QEMU_SH, self.folder, *command], check=True, capture_output=True, text=True
        )

    def lay_boot_files(self, files: Mapping[str, str]) -> None:
        """Put files into ecdaq/ of the boot partition, which starts at 4 MiB."""
        for name, text in files.items():
            (self.folder / "file").write_text(text)
            parent = str(Path(name).parent)
            if parent != ".":
                self.tool("mmd", "-D", "s", "-i", "disk.img@@4M", f"::ecdaq/{parent}")
            self.tool("mcopy", "-o", "-i", "disk.img@@4M", "file", f"::ecdaq/{name}")

    def start(self, extra: str = "") -> None:
        """Power on. The console of every boot goes to the same log, one behind the other."""
        assert self.process is None
        self.boots += 1
        log = self.folder / f"console-{self.boots}.log"
        command: list[str | Path] = [QEMU_SH, self.folder, "qemu-system-aarch64"]
        command += ["-M", "virt,gic-version=3", "-cpu", "cortex-a72", "-smp", "2", "-m", "1024"]
        command += [*self.accelerator, "-display", "none", "-no-reboot"]
        command += ["-kernel", "vmlinux", "-append", f"{self.cmdline} {extra}".strip()]
        command += ["-drive", "file=disk.img,if=none,format=raw,id=disk"]
        command += ["-device", "virtio-blk-pci,drive=disk", "-device", "virtio-rng-pci"]
        command += ["-netdev", f"user,id=lan,hostfwd=tcp:127.0.0.1:{self.port}-:22"]
        command += ["-device", "virtio-net-pci,netdev=lan,romfile=", "-serial", f"file:{log}"]
        self.process = subprocess.Popen(
            command,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=(self.folder / "qemu.log").open("ab"),
            start_new_session=True,
        )

    def console(self) -> str:
        """All that the console showed, without terminal control."""
        logs = [self.folder / f"console-{n}.log" for n in range(1, self.boots + 1)]
        return "".join(
            ANSI.sub("", log.read_text(errors="replace")) for log in logs if log.exists()
        )

    def console_of_this_boot(self) -> str:
        log = self.folder / f"console-{self.boots}.log"
        return ANSI.sub("", log.read_text(errors="replace")) if log.exists() else ""

    def has_console(self) -> bool:
        """Whether there is anything worth keeping."""
        return bool(self.console())

    def wait_for_console(self, pattern: str, seconds: float = BOOT_S) -> str:
        """Until the console of this boot shows `pattern`."""

        def seen() -> str | None:
            assert self.process is not None
            found = re.search(pattern, self.console_of_this_boot())
            if found is None and self.process.poll() is not None:
                log = (self.folder / "qemu.log").read_text(errors="replace")
                raise AssertionError(f"QEMU ended while waiting for /{pattern}/: {log[-500:]}")
            return found.group(0) if found else None

        return str(wait_for(f"console shows /{pattern}/", seconds, seen))

    def wait_for_login(self) -> None:
        """Until the machine is up, as its console says."""
        self.wait_for_console(r"\S+ login:")

    def ssh_command(self, *options: str) -> list[str]:
        return [
            *("ssh", "-q", "-p", str(self.port), "-i", str(self.key), "-o", "BatchMode=yes"),
            *("-o", "StrictHostKeyChecking=no", "-o", "UserKnownHostsFile=/dev/null"),
            *("-o", "ConnectTimeout=30", *options, "operator@127.0.0.1"),
        ]

    def try_run(self, command: str, seconds: float = 120) -> subprocess.CompletedProcess[str]:
        """A shell command in the guest; its exit code is the caller's to judge."""
        return subprocess.run(
            [*self.ssh_command(), command],
            capture_output=True,
            text=True,
            timeout=seconds,
            check=False,
        )

    def run(self, command: str, seconds: float = 120) -> str:
        """A shell command in the guest that has to succeed; what it printed."""
        result = self.try_run(command, seconds)
        assert result.returncode == 0, f"{command}: {result.returncode}\n{result.stderr}"
        return result.stdout

    def json(self, command: str) -> Any:
        """What a command in the guest printed, as JSON."""
        return json.loads(self.run(command))

    def wait_until(self, what: str, command: str, seconds: float = 120) -> None:
        """Until a command in the guest succeeds."""
        wait_for(what, seconds, lambda: self.try_run(command).returncode == 0)

    def cut_power(self) -> None:
        """QEMU is killed; nothing is written any more."""
        assert self.process is not None
        os.killpg(self.process.pid, signal.SIGKILL)
        self.process.wait(30)
        self.process = None

    def stop(self) -> None:
        """Whatever its state, it is off afterwards."""
        if self.process is not None and self.process.poll() is None:
            self.cut_power()
        self.process = None
