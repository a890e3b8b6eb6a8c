# SPDX-License-Identifier: MIT
"""ecdaq doctor on machines that have one thing wrong each."""

from __future__ import annotations

import pytest
from ecdaq import FAILED, fails
from made_machine import (
    CORE,
    CPU,
    KTHREAD,
    NET,
    OF_RUNNING_PROGRAMS,
    Files,
    Machine,
    checks,
    disk,
    examine,
    idle_state,
    irq_thread,
    report,
    thread,
)

# check, what is wrong, its level, a part of the value or the remedy
BAD: list[tuple[str, Files, str, str]] = [
    ("machine", {"/run/systemd/container": "lxc"}, "WARN", "do not apply to hardware"),
    (
        "machine",
        {"/proc/cpuinfo": "flags\t\t: fpu vme hypervisor\n"},
        "WARN",
        "a virtual machine (a hypervisor)",
    ),
    ("machine", {"/sys/class/dmi/id/sys_vendor": "QEMU\n"}, "WARN", "(QEMU)"),
    (
        "machine",
        {"/proc/device-tree/compatible": "linux,dummy-virt\0"},
        "WARN",
        "(QEMU's virt)",
    ),
    (
        "kernel",
        {"/sys/kernel/realtime": None, "/proc/sys/kernel/version": "#1 SMP PREEMPT_DYNAMIC\n"},
        "FAIL",
        "6.12.48-ecdaq is not PREEMPT_RT",
    ),
    ("isolation", {f"{CPU}/isolated": "\n"}, "FAIL", "isolcpus=managed_irq,domain,3"),
    ("isolation", {f"{CPU}/isolated": "2\n"}, "FAIL", "not isolated (isolated: 2)"),
    ("isolation", {f"{CPU}/online": "0-2\n"}, "FAIL", "core 3 does not exist (online: 0-2)"),
    ("nohz_full", {f"{CPU}/nohz_full": "(null)\n"}, "WARN", "nohz_full=3"),
    (
        "rcu_nocbs",
        {"/proc/cmdline": "ro rcu_nocbs=1-2\n", f"{CPU}/nohz_full": None},
        "WARN",
        "rcu_nocbs=3",
    ),
    (
        "rt_throttling",
        {"/proc/sys/kernel/sched_rt_runtime_us": "950000\n"},
        "WARN",
        "only 950000 us in each 1000000 us",
    ),
    ("timer_migration", {"/proc/sys/kernel/timer_migration": "1\n"}, "WARN", "timer_migration=0"),
    (
        "smt",
        {f"{CORE}/topology/thread_siblings_list": "1,3\n"},
        "WARN",
        "core 3 shares its hardware: cores 1,3",
    ),
    ("governor", {f"{CORE}/cpufreq/scaling_governor": "ondemand\n"}, "WARN", "echo performance"),
    ("idle_states", idle_state(11), "WARN", "may enter C6: exit latency 11 us"),
    ("core_users", thread(700, "equal", "3", (1, 80)), "FAIL", "equal (SCHED_FIFO 80) may preempt"),
    (
        "core_users",
        thread(700, "backup", "0-3"),
        "WARN",
        "1 other thread may run on core 3: backup",
    ),
    (
        "core_users",
        thread(700, "rogue", "3", (1, 99)),
        "FAIL",
        "rogue (SCHED_FIFO 99) may preempt the cycle on core 3",
    ),
    (
        "memory_lock",
        {"/proc/self/limits": "Max locked memory         8388608   8388608   bytes\n"},
        "WARN",
        "8192 KiB may be locked",
    ),
    (
        "swap",
        {"/proc/swaps": "Filename\tType\n/dev/zram0   partition\t100\t0\t-2\n"},
        "WARN",
        "memory that is not locked",
    ),
    (
        "huge_pages",
        {"/sys/kernel/mm/transparent_hugepage/enabled": "[always] madvise never\n"},
        "WARN",
        "echo madvise",
    ),
    ("nic", {NET: None, "/sys/class/net/eth0/": ""}, "FAIL", "there are: eth0"),
    ("nic", {f"{NET}/flags": "0x1002\n"}, "FAIL", "ip link set ecat0 up"),
    ("nic", {f"{NET}/carrier": "0\n"}, "FAIL", "no link"),
    ("nic", {f"{NET}/duplex": "half\n"}, "FAIL", "half duplex"),
    ("nic", {f"{NET}/speed": "1000\n"}, "WARN", "1000 Mbit/s"),
    ("nic_users", {"/calls/addresses.ecat0": "192.0.2.9 fe80::1\n"}, "WARN", "192.0.2.9 fe80::1"),
    ("nic_users", {f"{NET}/master": "-> ../br0"}, "FAIL", "a port of br0"),
    ("nic_users", {"/run/NetworkManager/devices/2": "[device]\nmanaged=true\n"}, "WARN", "nmcli"),
    (
        "nic_users",
        {"/proc/net/packet": "sk RefCnt Type Proto Iface\nffff 3 3 0003 0 1 0 0 99\n"},
        "WARN",
        "1 other packet socket receives",
    ),
    (
        "eee",
        {"/calls/eee.ecat0": "enabled 1\nactive 1\n"},
        "FAIL",
        "ethtool --set-eee ecat0 eee off",
    ),
    ("eee", {"/calls/eee.ecat0": "enabled 1\nactive 0\n"}, "WARN", "enabled"),
    (
        "coalescing",
        {"/calls/coalesce.ecat0": "rx_us 50\nrx_frames 16\nadaptive 0\n"},
        "WARN",
        "up to 50 us; the cycle waits 400 us",
    ),
    (
        "coalescing",
        {"/calls/coalesce.ecat0": "rx_us 400\nrx_frames 16\nadaptive 1\n"},
        "FAIL",
        "rx-usecs 0 rx-frames 1",
    ),
    (
        "nic_irqs",
        {"/proc/irq/40/effective_affinity_list": "0\n"},
        "WARN",
        "echo 3 > /proc/irq/40/smp_affinity_list",
    ),
    (
        "irq_threads",
        irq_thread(50),
        "FAIL",
        "irq/40-ecat0: SCHED_FIFO 50, not above the cycle's 80",
    ),
    (
        "irq_threads",
        thread(91, "napi/ecat0-8", "0-2", flags=KTHREAD),
        "WARN",
        "napi/ecat0-8: SCHED_OTHER, not above the cycle's 80",
    ),
    ("other_irqs", {"/proc/irq/34/effective_affinity_list": "3\n"}, "WARN", "mmc0"),
    (
        "clocksource",
        {"/sys/devices/system/clocksource/clocksource0/current_clocksource": "hpet\n"},
        "WARN",
        "hpet",
    ),
    (
        "ntp",
        {"/calls/clock": "synchronised 0\nerror_us 16000000\ntai_offset_s 37\n"},
        "WARN",
        "chronyc sources",
    ),
    (
        "tai",
        {"/calls/clock": "synchronised 1\nerror_us 850\ntai_offset_s 0\n"},
        "WARN",
        "TAI - UTC is 0 s instead of 37 s",
    ),
    (
        "tai",
        {"/calls/clock": "synchronised 1\nerror_us 850\ntai_offset_s 36\n"},
        "WARN",
        "is 36 s instead of 37 s",
    ),
    ("disk", disk(bytes_free=64 << 20, bytes_total=10**9), "FAIL", "recording stops below"),
    ("disk", disk(bytes_free=100 << 20, bytes_total=10**9), "WARN", "recording stops below"),
    ("inodes", disk(inodes_free=999), "WARN", "999 inodes free"),
    (
        "coalescing",
        {"/calls/coalesce.ecat0": "rx_us 0\nrx_frames 1\nadaptive 1\n"},
        "WARN",
        "up to 0 us, adaptively",
    ),
    ("irq_threads", irq_thread(80), "FAIL", "SCHED_FIFO 80, not above the cycle's 80"),
    ("watchdog", {"/sys/class/watchdog": None}, "WARN", "none"),
    (
        "watchdog",
        {"/sys/class/watchdog/watchdog0/state": "inactive\n"},
        "WARN",
        "RuntimeWatchdogSec=15s",
    ),
    (
        "watchdog",
        {"/sys/class/watchdog/watchdog0/identity": "Software Watchdog\n"},
        "WARN",
        "stops with the kernel",
    ),
    (
        "watchdog",
        {"/sys/class/watchdog/watchdog0/timeout": "16\n"},
        "WARN",
        "supports 15 s at most",
    ),
    (
        "disk",
        disk(read_only=1),
        "FAIL",
        "read-only",
    ),
    (
        "disk",
        disk(memory=1),
        "WARN",
        "in RAM",
    ),
    (
        "disk",
        disk(bytes_free=9999),
        "FAIL",
        "9.8 KiB free, recording stops below 64.0 MiB",
    ),
    (
        "disk",
        disk(bytes_free=1500000000),
        "WARN",
        "1.4 GiB free",
    ),
    (
        "inodes",
        disk(inodes_free=0),
        "FAIL",
        "0 inodes free",
    ),
    (
        "inodes",
        disk(inodes_free=9),
        "WARN",
        "9 inodes free",
    ),
    ("power", {"/calls/throttled": "flags 0x50005\n"}, "FAIL", "now: under-voltage, throttled"),
    ("power", {"/calls/throttled": "flags 0x80000\n"}, "WARN", "since boot, now over: hot"),
    (
        "power",
        {
            "/calls/throttled": None,
            "/sys/devices/platform/soc/soc:firmware/get_throttled": "50005\n",
        },
        "FAIL",
        "now: under-voltage, throttled",
    ),
    (
        "power",
        {
            "/calls/throttled": None,
            "/sys/class/hwmon/hwmon1/name": "rpi_volt\n",
            "/sys/class/hwmon/hwmon1/in0_lcrit_alarm": "1\n",
        },
        "FAIL",
        "now: under-voltage",
    ),
]


@pytest.mark.parametrize(("name", "wrong", "level", "message"), BAD)
def test_what_is_wrong_is_named_with_its_remedy(
    machine: Machine, name: str, wrong: Files, level: str, message: str
) -> None:
    machine.change(wrong)
    result = examine(machine, "--json")
    found = {check["name"]: check for check in report(result)["check"]}
    assert found[name]["level"] == level, found[name]
    assert message in f"{found[name]['value']} -> {found[name]['remedy']}"
    assert found[name]["remedy"]
    if level == "FAIL":
        fails(result, FAILED, "to fix:", name)
    else:
        assert examine(machine, "--strict").returncode == FAILED


def test_every_check_has_a_bad_machine(machine: Machine) -> None:
    # These two tell a fact, which cannot be bad.
    found = set(checks(machine)) - {name for name, *_ in BAD} - {"image", "slots"}
    assert found == OF_RUNNING_PROGRAMS
