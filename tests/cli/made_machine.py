# SPDX-License-Identifier: MIT
"""A machine made of files, for `ecdaq doctor --root`: a Raspberry Pi as it should be."""

from __future__ import annotations

import json
import shutil
import struct
from pathlib import Path
from typing import Any

from ecdaq import FAILED, OK, Result, ecdaq

CPU = "/sys/devices/system/cpu"
NET = "/sys/class/net/ecat0"
CORE = f"{CPU}/cpu3"
IMAGE = "ecdaq-image-ecdaq-qemuarm64 0.1.0-1a2b3c4, Debian archive: 2026-11-21"
KTHREAD = 0x00200040
FIFO, OTHER = 1, 0

CONFIG = """\
bus:
  interface: ecat0
cycle:
  cpu: 3
record:
  reserve: 64MiB
"""

# Checks without a result while no ecdaqd runs.
OF_RUNNING_PROGRAMS = {"cycle_thread", "page_faults", "sync0"}

# A path that ends in a slash is a folder, one with -> a symbolic link, None takes a file away.
Files = dict[str, "str | bytes | None"]

GOOD: Files = {
    "/proc/device-tree/model": "Raspberry Pi 4 Model B Rev 1.4\0",
    "/proc/device-tree/compatible": "raspberrypi,4-model-b\0brcm,bcm2711\0",
    "/proc/cpuinfo": "processor\t: 0\nFeatures\t: fp asimd\n",
    "/proc/cmdline": "ro isolcpus=managed_irq,domain,3 nohz_full=3 rcu_nocbs=3 irqaffinity=0-2\n",
    "/proc/sys/kernel/osrelease": "6.12.48-ecdaq\n",
    "/usr/lib/ecdaq/image": f"{IMAGE}\n",
    "/run/ecdaq-slots/slots": "A runs, B: 0.1.0-0f1e2d3\n",
    "/proc/sys/kernel/version": "#1 SMP PREEMPT_RT Debian 6.12.48-1\n",
    "/proc/sys/kernel/sched_rt_runtime_us": "-1\n",
    "/proc/sys/kernel/sched_rt_period_us": "1000000\n",
    "/proc/sys/kernel/timer_migration": "0\n",
    "/sys/kernel/realtime": "1\n",
    f"{CPU}/online": "0-3\n",
    f"{CPU}/isolated": "3\n",
    f"{CPU}/nohz_full": "3\n",
    f"{CORE}/topology/thread_siblings_list": "3\n",
    f"{CORE}/cpufreq/scaling_governor": "performance\n",
    f"{CORE}/cpufreq/scaling_min_freq": "600000\n",
    f"{CORE}/cpufreq/scaling_max_freq": "1500000\n",
    f"{CORE}/cpuidle/state0/name": "WFI\n",
    f"{CORE}/cpuidle/state0/latency": "1\n",
    f"{CORE}/cpuidle/state0/disable": "0\n",
    "/dev/cpu_dma_latency": struct.pack("=i", 0),
    "/proc/swaps": "Filename\t\t\t\tType\t\tSize\n",
    "/sys/kernel/mm/transparent_hugepage/enabled": "always [madvise] never\n",
    "/proc/self/limits": "Max locked memory         unlimited   unlimited   bytes\n",
    f"{NET}/flags": "0x1103\n",
    f"{NET}/carrier": "1\n",
    f"{NET}/speed": "100\n",
    f"{NET}/duplex": "full\n",
    f"{NET}/ifindex": "2\n",
    f"{NET}/device": "-> ../../../fd580000.ethernet",
    "/sys/fd580000.ethernet/": "",
    "/proc/net/packet": "sk               RefCnt Type Proto  Iface R Rmem   User   Inode\n"
    "ffff8881 3      3    88a4   2     1 0      0      12345\n",
    "/proc/interrupts": "           CPU0       CPU1       CPU2       CPU3\n"
    " 11:     123456        100        100        900     GICv2  30 Level     arch_timer\n"
    " 34:       5100          0          0          0     GICv2 158 Level     mmc0\n"
    " 39:          0          0          0          0     GICv2 190 Level     ecat0\n"
    " 40:         12          0          0    6100200     GICv2 189 Level     ecat0\n"
    "IPI0:        10         11         12         13       Rescheduling interrupts\n",
    # A timer that each core has of its own.
    "/proc/irq/11/effective_affinity_list": "\n",
    "/proc/irq/11/smp_affinity_list": "0-3\n",
    "/proc/irq/34/effective_affinity_list": "0\n",
    "/proc/irq/39/effective_affinity_list": "0\n",
    "/proc/irq/40/effective_affinity_list": "3\n",
    "/sys/devices/system/clocksource/clocksource0/current_clocksource": "arch_sys_counter\n",
    "/sys/class/watchdog/watchdog0/identity": "Broadcom BCM2835 Watchdog timer\n",
    "/sys/class/watchdog/watchdog0/state": "active\n",
    "/sys/class/watchdog/watchdog0/timeout": "15\n",
    "/calls/eee.ecat0": "enabled 0\nactive 0\n",
    "/calls/coalesce.ecat0": "rx_us 0\nrx_frames 1\nadaptive 0\n",
    "/calls/addresses.ecat0": "",
    "/calls/clock": "synchronised 1\nerror_us 850\ntai_offset_s 37\nutc_s 1795478400\n",
    "/calls/throttled": "flags 0\n",
}


def thread(
    tid: int,
    name: str,
    cores: str = "0-2",
    policy: tuple[int, int] = (OTHER, 0),
    flags: int = 0x400100,
    pid: int | None = None,
) -> Files:
    """The files of one thread; a process's own by default."""
    kind, priority = policy
    stat = [f"{tid} ({name}) S 1 1 1 0 -1 {flags}"] + ["0"] * 30 + [f"{priority} {kind} 0 0\n"]
    task = f"/proc/{pid or tid}/task/{tid}"
    return {
        f"{task}/stat": " ".join(stat),
        f"{task}/status": f"Name:\t{name}\nCpus_allowed:\tf\nCpus_allowed_list:\t{cores}\n",
    }


def irq_thread(priority: int = 85, name: str = "irq/40-ecat0") -> Files:
    return thread(90, name, "3", (FIFO, priority), KTHREAD)


def running_threads(pid: int, priority: int = 80, cores: str = "3", policy: int = FIFO) -> Files:
    """An ecdaqd with its cycle's thread."""
    return {
        **thread(pid, "ecdaqd"),
        **thread(4194000, "ecdaqd-cycle", cores, (policy, priority), pid=pid),
        f"/proc/{pid}/comm": "ecdaqd\n",
        f"/proc/{pid}/status": "Name:\tecdaqd\nVmLck:\t  131072 kB\n",
    }


def idle_state(latency_us: int, is_disabled: int = 0) -> Files:
    """A second idle state, and neither a process nor ecdaqd that limits the latency."""
    yaml = "bus:\n  interface: ecat0\ncycle:\n  cpu: 3\n  cpu_dma_latency: -1us\n"
    return {
        f"{CORE}/cpuidle/state1/name": "C6\n",
        f"{CORE}/cpuidle/state1/latency": f"{latency_us}\n",
        f"{CORE}/cpuidle/state1/disable": f"{is_disabled}\n",
        "/dev/cpu_dma_latency": struct.pack("=i", 2000000000),
        "ecdaq.yaml": yaml,
    }


def disk(**changed: int) -> Files:
    """The file system of the recordings."""
    figures = {"bytes_total": 32 * 10**9, "bytes_free": 30 * 10**9, "inodes_total": 2000000}
    figures |= {"inodes_free": 1999000, "read_only": 0, "memory": 0} | changed
    return {"/calls/disk": "".join(f"{key} {value}\n" for key, value in figures.items())}


GOOD |= disk() | thread(1, "systemd") | irq_thread() | thread(30, "ksoftirqd/3", "3", flags=KTHREAD)


class Machine:
    """The files of GOOD below a folder, and what a test changes."""

    def __init__(self, root: Path) -> None:
        self.root = root
        self.config = root / "ecdaq.yaml"
        self.config.write_text(CONFIG)
        self.change(GOOD)

    def change(self, files: Files) -> None:
        for name, content in files.items():
            path = self.root / name.strip("/")
            if path.is_symlink() or path.is_file():
                path.unlink()
            elif path.is_dir() and content is None:
                shutil.rmtree(path)
            if content is None:
                continue
            if name.endswith("/"):
                path.mkdir(parents=True, exist_ok=True)
                continue
            path.parent.mkdir(parents=True, exist_ok=True)
            if isinstance(content, bytes):
                path.write_bytes(content)
            elif content.startswith("-> "):
                path.symlink_to(content[3:])
            else:
                path.write_text(content)


def examine(machine: Machine, *words: str, run_dir: Path | None = None) -> Result:
    where = [] if run_dir is None else ["--run-dir", str(run_dir)]
    root = ["--root", str(machine.root), "--config", str(machine.config)]
    return ecdaq(None, *where, "doctor", *root, *words)


def report(result: Result) -> dict[str, Any]:
    assert result.returncode in (OK, FAILED), result.stderr
    assert result.stdout.count("\n") == 1
    return json.loads(result.stdout)


def checks(machine: Machine, run_dir: Path | None = None) -> dict[str, dict[str, Any]]:
    found = report(examine(machine, "--json", run_dir=run_dir))["check"]
    return {check["name"]: check for check in found}
