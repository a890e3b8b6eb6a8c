# SPDX-License-Identifier: MIT
"""ecdaq doctor on machines made of files: a good one, one that is bare, one that runs."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from ecdaq import CONFIG, NOBODY, OK, USAGE, Fake, ecdaq, fails, works
from made_machine import (
    CORE,
    CPU,
    GOOD,
    IMAGE,
    KTHREAD,
    NET,
    OF_RUNNING_PROGRAMS,
    OTHER,
    Files,
    Machine,
    checks,
    disk,
    examine,
    idle_state,
    irq_thread,
    report,
    running_threads,
    thread,
)


def test_a_good_machine_has_nothing_to_fix(machine: Machine) -> None:
    text = works(examine(machine, "--strict"))
    found = checks(machine)
    assert {name for name, check in found.items() if check["level"] != "OK"} == OF_RUNNING_PROGRAMS
    assert "port ecat0, cycle core 3, priority 80" in text.splitlines()[0]
    assert text.splitlines()[-1] == "33 checks: 30 ok, 0 warn, 0 fail, 3 skipped"


def test_the_image_and_the_commit_that_it_was_built_from_are_shown(machine: Machine) -> None:
    assert checks(machine)["image"]["value"] == IMAGE
    machine.change({"/usr/lib/ecdaq/image": None})
    assert checks(machine)["image"]["level"] == "SKIP"


@pytest.mark.parametrize(("archive", "old"), [("2026-08-26", False), ("2026-08-25", True)])
def test_an_image_without_three_months_of_security_updates_is_too_old(
    machine: Machine, archive: str, old: bool
) -> None:
    """The made machine's clock is at 2026-11-24."""
    text = f"ecdaq-image-x 0.1.0-1a2b3c4, Debian archive: {archive}"
    machine.change({"/usr/lib/ecdaq/image": text + "\n"})
    check = checks(machine)["image"]
    if not old:
        assert (check["level"], check["value"]) == ("OK", text)
        return
    assert check["level"] == "WARN"
    assert check["value"].startswith(f"{text}: 91 days old")
    assert "--refresh" in check["remedy"]
    # A clock that was never set says nothing about the age.
    machine.change({"/calls/clock": "synchronised 0\nerror_us 1\ntai_offset_s 0\nutc_s 0\n"})
    assert checks(machine)["image"]["level"] == "OK"


def test_the_slots_are_shown(machine: Machine) -> None:
    assert checks(machine)["slots"]["value"] == "A runs, B: 0.1.0-0f1e2d3"
    machine.change({"/run/ecdaq-slots/slots": None})
    assert checks(machine)["slots"]["level"] == "SKIP"


# check, what is otherwise and still good, expected text
ALSO_GOOD: list[tuple[str, Files, str]] = [
    ("idle_states", idle_state(10), "at most C6: exit latency 10 us"),
    ("idle_states", idle_state(133, is_disabled=1), "at most WFI: exit latency 1 us"),
    ("disk", disk(bytes_free=1500000001, bytes_total=30 * 10**9), "1.4 GiB free"),
    ("inodes", disk(inodes_free=1000), "1000 inodes free"),
    ("irq_threads", irq_thread(81), "above the cycle's 80"),
    (
        "other_irqs",
        {
            "/proc/interrupts": " 34:  0  0  0  0  GICv2 158 Level  mmc0\n",
            "/proc/irq/34/effective_affinity_list": "3\n",
        },
        "none on core 3",
    ),
    ("core_users", thread(700, "backup", "0-2"), "no other thread"),
    ("kernel", {"/sys/kernel/realtime": None}, "PREEMPT_RT"),
    (
        "isolation",
        {f"{CPU}/isolated": "\n", "/sys/fs/cgroup/cpuset.cpus.isolated": "3\n"},
        "core 3",
    ),
    ("rcu_nocbs", {"/proc/cmdline": "ro nohz_full=3\n"}, "implied by nohz_full"),
    ("rcu_nocbs", {"/proc/cmdline": "rcu_nocbs=all"}, "rcu_nocbs=all"),
    ("rt_throttling", {"/proc/sys/kernel/sched_rt_runtime_us": "1000000\n"}, "off"),
    ("governor", {f"{CORE}/cpufreq": None}, "does not change"),
    ("idle_states", {f"{CORE}/cpuidle": None}, "idle states"),
    (
        "idle_states",
        {f"{CORE}/cpuidle/state1/latency": "133\n", "/dev/cpu_dma_latency": None},
        "while ecdaqd runs",
    ),
    ("swap", {"/proc/swaps": None}, "not built into"),
    ("nic", {f"{NET}/device": None}, "virtual port"),
    ("nic", {f"{NET}/speed": "-1\n"}, "speed unknown"),
    ("eee", {"/calls/eee.ecat0": "unsupported\n"}, "no energy-efficient"),
    ("coalescing", {"/calls/coalesce.ecat0": "unsupported\n"}, "no interrupt coalescing"),
    ("coalescing", {"/calls/coalesce.ecat0": "rx_us 57\nrx_frames 1\nadaptive 0\n"}, "rx-frames 1"),
    ("core_users", thread(701, "ksmd (odd)", "0-3", flags=KTHREAD), "no other thread"),
    (
        "inodes",
        disk(inodes_total=0),
        "no inode limit",
    ),
    (
        "nic_irqs",
        {
            "/proc/interrupts": " 38:  0  0  0  59224  PCI-MSIX-0000:00:03.0 1-edge virtio2-input",
            f"{NET}/device": "-> ../../../virtio2",
            "/sys/virtio2/": "",
            "/proc/irq/38/effective_affinity_list": "3\n",
        },
        "1 of ecat0 on core 3",
    ),
]


@pytest.mark.parametrize(("name", "other", "message"), ALSO_GOOD)
def test_what_is_good_in_another_way_is_ok(
    machine: Machine, name: str, other: Files, message: str
) -> None:
    machine.change(other)
    check = checks(machine)[name]
    assert check["level"] == "OK" and check["remedy"] is None, check
    assert message in check["value"]


def test_a_bare_machine_skips_and_never_crashes(tmp_path: Path) -> None:
    result = ecdaq(None, "doctor", "--root", str(tmp_path), "--json")
    found = report(result)
    assert found["config"] == "defaults"
    assert found["ok"] + found["warn"] + found["fail"] + found["skip"] == 33
    assert found["fail"] == 0 and result.returncode == OK


# check, what is absent or off, a part of the reason
SKIPPED: list[tuple[str, Files, str]] = [
    ("kernel", {"/proc/sys/kernel/osrelease": None}, "osrelease: not found"),
    ("isolation", {f"{CPU}/online": None}, "online: not found"),
    ("rt_throttling", {"/proc/sys/kernel/sched_rt_runtime_us": "much\n"}, "unexpected content"),
    ("timer_migration", {"/proc/sys/kernel/timer_migration": None}, "not found"),
    ("smt", {f"{CORE}/topology/thread_siblings_list": None}, "not found"),
    ("idle_states", {f"{CORE}/cpuidle/state0/latency": "low\n"}, "cpuidle: unexpected content"),
    ("core_users", {"/proc/1": None}, "/proc/1: permission denied"),
    ("memory_lock", {"/proc/self/limits": None}, "limits: not found"),
    ("nic_users", {NET: None}, "ecat0: no such port"),
    ("eee", {"/calls/eee.ecat0": None}, "eee enabled: not found"),
    ("coalescing", {"/calls/coalesce.ecat0": "rx_us 1\n"}, "coalescing: unexpected content"),
    ("nic_irqs", {"/proc/interrupts": ""}, "no interrupt of ecat0"),
    ("irq_threads", {"/proc/90": None}, "no interrupt thread of ecat0"),
    ("other_irqs", {"/proc/interrupts": None}, "/proc/interrupts: not found"),
    ("ntp", {"/calls/clock": None}, "clock error_us: not found"),
    ("tai", {"/calls/clock": "synchronised 1\nerror_us 1\n"}, "unexpected content"),
    ("disk", {"/calls/disk": None}, "/var/lib/ecdaq: not found"),
    ("inodes", {"ecdaq.yaml": "record:\n  enable: off\n"}, "record.enable"),
    ("power", {"/proc/device-tree/model": None}, "not a Raspberry Pi"),
]


@pytest.mark.parametrize(("name", "other", "reason"), SKIPPED)
def test_a_check_that_cannot_be_made_is_skipped_with_its_reason(
    machine: Machine, name: str, other: Files, reason: str
) -> None:
    machine.change(other)
    check = checks(machine)[name]
    assert check["level"] == "SKIP" and reason in check["value"], check


@pytest.mark.parametrize("garbage", ["", "\0\0\0", "-\n", "99999999999999999999999\n", "x" * 5000])
def test_garbage_in_every_file_never_crashes(machine: Machine, garbage: str) -> None:
    for name, content in GOOD.items():
        if not name.endswith("/") and not str(content).startswith("-> "):
            machine.change({name: garbage})
    found = report(examine(machine, "--json"))
    assert len(found["check"]) == 33


# --- with an ecdaqd ---

RUNNING: list[tuple[str, tuple[str, ...], dict[str, Any], str, str]] = [
    ("cycle_thread", ("DEGRADED=0",), {}, "OK", "SCHED_FIFO 80 on core 3"),
    ("cycle_thread", (), {"policy": OTHER, "priority": 0}, "FAIL", "LimitRTPRIO=98"),
    ("cycle_thread", (), {"priority": 40}, "WARN", "SCHED_FIFO 40, but cycle.priority is 80"),
    ("cycle_thread", (), {"cores": "0-3"}, "FAIL", "may run on 0-3 instead of core 3 alone"),
    ("page_faults", (), {}, "OK", "0 in"),
    ("page_faults", ("FAULTS=7",), {}, "FAIL", "7 in"),
    ("sync0", (), {}, "SKIP", "ecdaq-sync0 is not running"),
    ("sync0", ("BEYOND=0",), {}, "OK", "every slave with SYNC0"),
    ("sync0", ("BEYOND=1",), {}, "WARN", "not checked: slave 64 (valve7): only 64 lines"),
    ("core_users", (), {}, "OK", "no other thread"),
    ("memory_lock", ("DEGRADED=0",), {}, "OK", "131072 KiB"),
    ("memory_lock", ("DEGRADED=4",), {}, "FAIL", "LimitMEMLOCK=infinity"),
]


@pytest.mark.parametrize(("name", "settings", "thread_is", "level", "message"), RUNNING)
def test_a_running_ecdaqd_is_checked(
    machine: Machine,
    fake: Callable[..., Fake],
    name: str,
    settings: tuple[str, ...],
    thread_is: dict[str, Any],
    level: str,
    message: str,
) -> None:
    running = fake(*settings)
    machine.change(running_threads(running.process.pid, **thread_is))
    check = checks(machine, running.run_dir)[name]
    assert check["level"] == level, check
    assert message in f"{check['value']} -> {check['remedy']}"


def test_refused_cpu_dma_latency_shows_in_idle_states(
    machine: Machine, fake: Callable[..., Fake]
) -> None:
    deep: Files = {f"{CORE}/cpuidle/state1/latency": "133\n", "/dev/cpu_dma_latency": None}
    machine.change(deep)
    assert checks(machine, fake("DEGRADED=8").run_dir)["idle_states"]["level"] == "WARN"


def test_an_ecdaqd_without_a_cycle_or_gone_is_skipped(
    machine: Machine, fake: Callable[..., Fake]
) -> None:
    running = fake()
    check = checks(machine, running.run_dir)["cycle_thread"]
    assert check["level"] == "SKIP" and "no cycle now" in check["value"]
    running.kill()
    check = checks(machine, running.run_dir)["cycle_thread"]
    assert check["level"] == "SKIP" and "not running" in check["value"]


def test_a_copy_with_an_ecdaqd_in_it_is_checked_without_a_status_page(machine: Machine) -> None:
    machine.change(running_threads(500))
    found = checks(machine)
    assert found["cycle_thread"]["value"] == "SCHED_FIFO 80 on core 3"
    assert found["memory_lock"]["value"] == "131072 KiB of ecdaqd are locked"
    assert found["page_faults"]["value"] == "ecdaqd's status page: not found"
    machine.change({"/proc/500/status": "VmLck:\t  0 kB\n"})
    assert checks(machine)["memory_lock"]["level"] == "FAIL"


def test_a_status_page_of_another_version_is_reported(machine: Machine, run_dir: Path) -> None:
    (run_dir / "status").write_bytes(b"cdqstat1" + bytes(64))
    machine.change(running_threads(500))
    found = checks(machine, run_dir)
    assert found["cycle_thread"]["level"] == "OK"
    assert (
        found["page_faults"]["value"] == "ecdaqd's status page: written by another version of ecdaq"
    )


# What ecdaqd was started with, and port, core and priority by it.
COMMAND_LINES = [
    (["--config", "/etc/e.yaml"], ("ecat0", 3, 77)),
    (["--config=/etc/e.yaml", "--set", "cycle.cpu=2", "--set=cycle.priority=60"], ("ecat0", 2, 60)),
    (["--config", "/etc/e.yaml", "--interface", "ecat9"], ("ecat9", 3, 77)),
    (["--interface=ecat9", "--simulated"], ("ecat9", -1, 80)),
    (["--config", "/absent.yaml", "--set", "cycle.cpu=2"], ("", 2, 80)),
    (["--config"], ("", -1, 80)),
]


@pytest.mark.parametrize(("words", "wanted"), COMMAND_LINES)
def test_the_command_line_of_the_ecdaqd_that_runs_is_what_counts(
    machine: Machine, words: list[str], wanted: tuple[str, int, int]
) -> None:
    yaml = "bus:\n  interface: ecat0\ncycle:\n  cpu: 3\n  priority: 77\n"
    machine.change(running_threads(500) | {"/etc/e.yaml": yaml})
    machine.change({"/proc/500/cmdline": "\0".join(["/usr/bin/ecdaqd", *words]) + "\0"})
    found = report(ecdaq(None, "doctor", "--root", str(machine.root), "--json"))
    assert (found["interface"], found["cycle_cpu"], found["cycle_priority"]) == wanted
    assert ("/absent.yaml" in found["config"]) == ("/absent.yaml" in words)


# --- this machine ---


def test_this_machine_is_examined_with_the_port_of_the_ecdaqd_that_runs(daemon: Fake) -> None:
    found = report(daemon("doctor", "--json"))
    assert found["running"] is True and found["interface"] == "ecat0"
    assert len(found["check"]) == 33
    assert report(daemon("doctor", "--json", "--interface", "lo"))["interface"] == "lo"


@pytest.mark.skipif(os.geteuid() != 0, reason="makes a network namespace, which takes root")
def test_a_port_in_a_network_of_ecdaqd_s_own_is_skipped(fake: Callable[..., Fake]) -> None:
    running = fake(how=["unshare", "--net"])
    found = {check["name"]: check for check in report(running("doctor", "--json"))["check"]}
    for name in ("nic", "nic_users", "eee", "coalescing"):
        assert found[name]["level"] == "SKIP"
        assert "a network namespace of ecdaqd's own" in found[name]["value"]


@pytest.mark.skipif(os.geteuid() != 0, reason="becomes another user, which takes root")
def test_without_root_what_could_not_be_read_is_reported(fake: Callable[..., Fake]) -> None:
    running = fake("MODE=600")
    result = running("doctor", "--json", user=NOBODY)
    found = {check["name"]: check for check in report(result)["check"]}
    assert found["page_faults"]["level"] == "SKIP" and found["page_faults"]["wants_root"] is True
    text = running("doctor", user=NOBODY).stdout
    assert "could not be read as this user: run ecdaq doctor as root" in text.splitlines()[-1]


def test_mistakes_are_named(machine: Machine, tmp_path: Path) -> None:
    fails(ecdaq(None, "doctor", "--root", "/nonexistent"), USAGE, "--root: /nonexistent")
    machine.config.write_text("cycle:\n  cpu: many\n")
    fails(examine(machine), CONFIG, "ecdaq.yaml:2: cycle.cpu")
    fails(ecdaq(None, "doctor", "word"), USAGE, "unexpected argument")


def test_the_appliance_s_own_configuration_is_found(machine: Machine) -> None:
    machine.change({"/run/ecdaq-boot/ecdaq.yaml": "bus:\n  interface: ecat7\n"})
    found = report(ecdaq(None, "doctor", "--root", str(machine.root), "--json"))
    assert found["interface"] == "ecat7" and found["cycle_cpu"] == -1
    assert found["config"] == "/run/ecdaq-boot/ecdaq.yaml"
    options = "ECDAQ_OPTIONS= --set bus.interface=ecat0 --set cycle.cpu=3\n"
    machine.change({"/run/ecdaq-boot/environment": options})
    found = report(ecdaq(None, "doctor", "--root", str(machine.root), "--json"))
    assert found["interface"] == "ecat0" and found["cycle_cpu"] == 3
    assert found["config"] == "/run/ecdaq-boot/ecdaq.yaml and its command line"
