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
import tempfile
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

TOP = Path(__file__).resolve().parents[2]
IMAGE = Path(os.environ.get("ECDAQ_IMAGE_DIR", TOP / "build" / "image" / "ecdaq-qemuarm64"))
NAME = "ecdaq-image-ecdaq-ecdaq-qemuarm64"
TOOLS = TOP / "app" / "tools" / "image"
# An emulator on a busy machine: limits that only a hang exceeds.
BOOT_S = float(os.environ.get("ECDAQ_BOOT_SECONDS", "1800"))
COMMAND_S = 600.0
POLL_S = 0.2
DISK_BYTES = 2 << 30
ANSI = re.compile(r"\x1b\[[0-9;?]*[A-Za-z]|\r")
# Runs a command ahead of the host's other work, also where the kernel groups that by session.
AHEAD = (
    *("sh", "-c", '{ echo -15 > /proc/self/autogroup; } 2> /dev/null; exec nice -n -15 "$@"'),
    "ahead",
)


def profile(timing: str) -> str:
    """The settings for emulation that ./build.sh boot takes, too."""
    return (TOOLS / f"profile-{timing}.yaml").read_text()


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
    """A free TCP port of the loopback address."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


class Space:
    """A network namespace with two taps: the machine's LAN port and its EtherCAT port."""

    HOST, GUEST = "192.168.77.1", "192.168.77.2"

    def __init__(self) -> None:
        self.holder = subprocess.Popen(
            ["unshare", "--net", "sh", "-c", "echo ready; exec cat"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        assert self.holder.stdout is not None
        assert self.holder.stdout.readline() == "ready\n", "no network namespace available"
        self.enter = ["nsenter", "--target", str(self.holder.pid), "--net"]
        self.run("ip", "link", "set", "lo", "up")
        for tap in ("lan", "ecat"):
            self.run("ip", "tuntap", "add", "dev", tap, "mode", "tap")
        self.run("ip", "link", "set", "ecat", "arp", "off", "multicast", "off", "up")
        self.run("ip", "address", "add", f"{self.HOST}/24", "dev", "lan")
        self.run("ip", "link", "set", "lan", "multicast", "on", "up")

    def run(self, *command: str) -> None:
        subprocess.run([*self.enter, *command], check=True, capture_output=True, timeout=60)

    def close(self) -> None:
        assert self.holder.stdin is not None
        self.holder.stdin.close()
        self.holder.wait(10)


class Machine:
    """One virtual machine with a disk of its own, made from the image.

    timing: "guest" or "host", see app/tools/image/virt.sh. With a space, its ports lead there.
    """

    def __init__(
        self,
        folder: Path,
        image: Path,
        key: Path,
        timing: str,
        space: Space | None = None,
        disk_bytes: int = DISK_BYTES,
    ) -> None:
        self.folder = folder
        self.key = key
        self.timing = timing
        self.space = space
        self.disk = folder / "disk.img"
        self.disk_before = folder / "disk-before.img"
        self.write_log = folder / "writes.log"
        subprocess.run(["cp", "--sparse=always", image, self.disk], check=True)
        # The data partition has to grow into what the image does not have.
        with self.disk.open("r+b") as disk:
            disk.truncate(disk_bytes)
        shutil.copy(IMAGE / f"{NAME}-u-boot.bin", folder / "u-boot.bin")
        self.port = free_port()
        self.process: subprocess.Popen[bytes] | None = None
        self.boots = 0
        # One connection for all commands: a log-in costs the emulated machine seconds. It ends with
        # the machine. The path of a socket has to be short.
        self.short = tempfile.TemporaryDirectory(prefix="ecdaq-ssh-")
        self.connection = Path(self.short.name) / "to"

    def tool(self, *command: str | Path) -> subprocess.CompletedProcess[str]:
        """A program of the SDK chroot, in the folder of this machine."""
        return subprocess.run(
            [TOOLS / "qemu.sh", self.folder, *command], check=True, capture_output=True, text=True
        )

    def partitions(self) -> dict[str, tuple[int, int]]:
        """First sector and number of sectors of each, by its name."""
        table = json.loads(self.tool("sfdisk", "--json", "disk.img").stdout)["partitiontable"]
        return {p["name"]: (p["start"], p["size"]) for p in table["partitions"]}

    def write_boot_files(self, files: Mapping[str, str]) -> None:
        """Put files into ecdaq/ of the boot partition, which starts at 4 MiB."""
        for name, text in files.items():
            (self.folder / "file").write_text(text)
            parent = str(Path(name).parent)
            if parent != ".":
                self.tool("mmd", "-D", "s", "-i", "disk.img@@4M", f"::ecdaq/{parent}")
            self.tool("mcopy", "-o", "-i", "disk.img@@4M", "file", f"::ecdaq/{name}")

    def ports(self) -> list[str]:
        """QEMU's options for the machine's network."""
        nic = "virtio-net-pci,romfile="
        if self.space is None:
            forward = f"user,id=lan,hostfwd=tcp:127.0.0.1:{self.port}-:22"
            return ["-netdev", forward, "-device", f"{nic},netdev=lan"]
        tap = "tap,script=no,downscript=no"
        return [
            *("-netdev", f"{tap},id=lan,ifname=lan", "-device", f"{nic},netdev=lan"),
            *("-netdev", f"{tap},id=ecat,ifname=ecat"),
            *("-device", f"{nic},netdev=ecat,mac=52:54:00:ec:da:01"),
        ]

    def wire_options(self) -> tuple[str, ...]:
        """QEMU's options for app/tools/image/sync0-wire.py."""
        at = f"unix:{self.folder}"
        return (
            *("-qtest", f"{at}/qtest,server=on,wait=off", "-qtest-log", "none"),
            *("-qmp", f"{at}/qmp,server=on,wait=off"),
        )

    def start(
        self,
        append: str = "",
        options: tuple[str, ...] = (),
        ahead: tuple[str, ...] = (),
        log_writes: bool = False,
    ) -> None:
        """Power on; `ahead` is a command that runs QEMU. Each boot has a console log of its own.

        log_writes: keep the disk as it is now, and log what is written to it from now on.
        """
        assert self.process is None
        self.disconnect()
        if log_writes:
            subprocess.run(["cp", "--sparse=always", self.disk, self.disk_before], check=True)
            self.write_log.write_bytes(b"")
        self.boots += 1
        log = self.folder / f"console-{self.boots}.log"
        outside = "" if self.space is None else "ecdaq.segment=outside"
        self.process = subprocess.Popen(
            [
                *(self.space.enter if self.space is not None else []),
                *ahead,
                *(TOOLS / "virt.sh", self.folder, self.timing, "-display", "none"),
                *("-serial", f"file:{log}", *self.ports(), *options),
            ],
            env=os.environ
            | {"ECDAQ_APPEND": f"{outside} {append}".strip()}
            | ({"ECDAQ_WRITE_LOG": self.write_log.name} if log_writes else {}),
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
        """Until the console shows that the machine is up."""
        self.wait_for_console(r"\S+ login:")

    def ssh_command(self, *options: str) -> list[str]:
        space = self.space
        where = ("127.0.0.1", str(self.port)) if space is None else (space.GUEST, "22")
        return [
            *(space.enter if space is not None else []),
            *("ssh", "-q", "-p", where[1], "-i", str(self.key), "-o", "BatchMode=yes"),
            *("-o", "StrictHostKeyChecking=no", "-o", "UserKnownHostsFile=/dev/null"),
            *("-o", "ControlMaster=auto", "-o", f"ControlPath={self.connection}"),
            *("-o", "ControlPersist=yes", "-o", "ConnectTimeout=30"),
            *(*options, f"operator@{where[0]}"),
        ]

    def disconnect(self) -> None:
        """The connection ends, if there is one."""
        if self.connection.exists():
            command = ["ssh", "-q", "-o", f"ControlPath={self.connection}", "-O", "exit", "machine"]
            subprocess.run(command, capture_output=True, timeout=60, check=False)
            self.connection.unlink(missing_ok=True)

    def try_run(self, command: str, seconds: float = COMMAND_S) -> subprocess.CompletedProcess[str]:
        """A shell command in the guest; the caller checks its exit code."""
        return subprocess.run(
            [*self.ssh_command(), command],
            capture_output=True,
            text=True,
            timeout=seconds,
            check=False,
        )

    def run(self, command: str, seconds: float = COMMAND_S) -> str:
        """A shell command in the guest that has to succeed; what it printed."""
        result = self.try_run(command, seconds)
        assert result.returncode == 0, f"{command}: {result.returncode}\n{result.stderr}"
        return result.stdout

    def json(self, command: str) -> Any:
        """What a command in the guest printed, as JSON."""
        return json.loads(self.run(command))

    def answer(self, command: str) -> dict[str, Any]:
        """What a command in the guest printed, as JSON; {} while it prints nothing."""
        result = self.try_run(command)
        found: dict[str, Any] = json.loads(result.stdout) if result.returncode == 0 else {}
        return found

    def status(self) -> dict[str, Any]:
        """The master's status."""
        return self.answer("ecdaq status --json")

    def sync0(self) -> dict[str, Any]:
        """The report of ecdaq-sync0."""
        return self.answer("ecdaq sync0 --json")

    def wait_until(self, what: str, command: str, seconds: float = COMMAND_S) -> None:
        """Until a command in the guest succeeds."""
        wait_for(what, seconds, lambda: self.try_run(command).returncode == 0)

    def cut_power(self) -> None:
        """QEMU is killed; nothing is written any more."""
        assert self.process is not None
        os.killpg(self.process.pid, signal.SIGKILL)
        self.process.wait(30)
        self.process = None
        self.disconnect()

    def stop(self) -> None:
        """Whatever its state, it is off afterwards."""
        if self.process is not None and self.process.poll() is None:
            self.cut_power()
        self.process = None
        self.disconnect()
