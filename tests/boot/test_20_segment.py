# SPDX-License-Identifier: MIT
"""The bus reaches OP without an operator, on its own core, and every cycle is recorded.

In guest time (app/tools/image/virt.sh): the guest's clock counts instructions, so that a cycle of
1 ms holds whatever the host does. All times printed here are guest time, not those of a board.

ECDAQ_BOOT_CYCLES: how many cycles are looked at (60,000).
"""

from __future__ import annotations

import json
import os
import re

from machine import Machine, profile, wait_for

BOOT_FILES = {"ecdaq.yaml": profile("guest")}
CYCLES = int(os.environ.get("ECDAQ_BOOT_CYCLES", "60000"))
OP_S = 900
SETTLE_S = 3


def test_two_slaves_reach_op_without_operator_action(machine: Machine) -> None:
    wait_for("OP", OP_S, lambda: machine.status().get("state") == "OP")
    found = machine.status()
    assert found["slaves"] == 2
    assert found["rt_degraded"] == []
    assert found["cycle_cpu"] == 1
    assert found["dc_state"] == "locked"


def test_the_boot_is_split_by_phase(machine: Machine) -> None:
    """From the kernel's first instruction to OP, as the guest's own clock has it."""
    kernel = machine.run("systemd-analyze time")
    journal = machine.run(
        "sudo journalctl --boot --unit=ecdaqd --output=short-monotonic --no-pager"
    )
    at = {
        what: float(re.findall(rf"\[ *([0-9.]+)\] .*{what}", journal)[0])
        for what in ("Starting ecdaqd", "slaves in OP")
    }
    print(f"\nboot, guest time: {kernel.splitlines()[0]}")
    print(f"ecdaqd is started {at['Starting ecdaqd']:.3f} s, OP {at['slaves in OP']:.3f} s")
    print(machine.run("free --mebi; df --output=source,size,used,target -BM / /data"))
    assert at["slaves in OP"] < 30


def test_cycles_continue_without_loss(machine: Machine) -> None:
    """CYCLES of them, with no login but the one that waits for the end."""
    before = machine.status()
    until = before["cycle_number"] + CYCLES
    machine.run(
        "until ecdaq status --json | grep -Eo '\"cycle_number\":[0-9]+' | cut -d : -f 2 |"
        f" (read n && [ $n -ge {until} ]); do sleep {SETTLE_S}; done",
        seconds=3000,
    )
    after = machine.status()
    grown = {
        name: after[name] - before[name]
        for name in (
            *("cycles", "frames_lost", "frames_late", "overruns", "cycles_skipped"),
            *("samples_good", "samples_bad", "dc_unlocks", "recorded_cycles"),
        )
    }
    print(f"\nguest time, of these cycles alone: {grown}")
    for name in ("wake_latency_ns", "round_trip_ns", "phase_ns"):
        print(f"guest time, since the start: {name} {after[name]}")
    print("guest time:\n" + machine.run("ecdaq histogram wake; ecdaq histogram round-trip"))
    assert grown["cycles"] >= CYCLES
    for name in ("frames_lost", "overruns", "cycles_skipped", "samples_bad", "dc_unlocks"):
        assert grown[name] == 0, grown
    assert after["dc_state"] == "locked"
    assert after["recorded_gaps"] == 0


def test_the_cycle_thread_had_no_page_fault(machine: Machine) -> None:
    assert machine.status()["page_faults"] == 0


def test_the_doctor_finds_nothing_that_fails(machine: Machine) -> None:
    result = machine.try_run("sudo ecdaq doctor --json", seconds=600)
    found = json.loads(result.stdout)
    not_ok = [(c["name"], c["level"], c["value"]) for c in found["check"] if c["level"] != "OK"]
    print(f"\ndoctor: {found['ok']} OK, {found['warn']} WARN, {found['skip']} SKIP")
    print("\n".join(f"  {level} {name}: {value}" for name, level, value in not_ok))
    assert found["fail"] == 0, not_ok
    assert result.returncode == 0


def test_no_service_was_restarted(machine: Machine) -> None:
    for unit in ("ecdaqd", "ecdaq-record", "ecdaq-segment"):
        restarts = machine.run(f"systemctl show --property=NRestarts --value {unit}")
        assert restarts.strip() == "0", unit


def test_the_recording_is_whole(machine: Machine) -> None:
    checked = machine.json("sudo ecdaq log check --dir /data/record --json")
    print(checked)
    assert checked["clean"] is True
    assert (checked["gaps"], checked["cycles_missing"], checked["damaged_files"]) == (0, 0, 0)
    assert checked["cycles"] >= CYCLES


def cycle_thread(machine: Machine) -> str:
    """Of ecdaqd's threads the one with a real-time policy that runs on the isolated core."""
    threads = machine.run(
        "for t in /proc/$(pgrep -x ecdaqd)/task/*; do"
        " echo $(basename $t) $(chrt --pid $(basename $t) | grep -o 'SCHED_[A-Z]*')"
        " $(chrt --pid $(basename $t) | tail -n 1 | grep -o '[0-9]*$')"
        " $(grep Cpus_allowed_list $t/status | cut -f 2); done"
    )
    return threads


def test_the_cycle_thread_is_alone_on_its_core_with_its_priority(machine: Machine) -> None:
    rows = [line.split() for line in cycle_thread(machine).splitlines()]
    fifo = [row for row in rows if row[1] == "SCHED_FIFO"]
    assert [row[2:] for row in fifo] == [["80", "1"]], rows
    assert all(row[3] == "0" for row in rows if row not in fifo), rows


def test_nothing_else_of_user_space_may_run_on_that_core(machine: Machine) -> None:
    others = machine.run(
        "for p in /proc/[0-9]*; do [ -s $p/cmdline ] || continue;"
        " grep -q ecdaqd $p/comm && continue;"
        " echo $(cat $p/comm) $(grep Cpus_allowed_list $p/status | cut -f 2); done"
    )
    assert [x for x in others.splitlines() if not x.endswith(" 0")] == []


def test_ecdaqd_has_one_capability_and_no_more(machine: Machine) -> None:
    status = machine.run("cat /proc/$(pgrep -x ecdaqd)/status")
    fields = dict(line.split(":\t", 1) for line in status.splitlines() if ":\t" in line)
    net_raw = 1 << 13
    for name in ("CapPrm", "CapEff", "CapBnd", "CapAmb"):
        assert int(fields[name], 16) == net_raw, name
    assert fields["NoNewPrivs"].strip() == "1"
    assert int(fields["Uid"].split()[0]) == 901


def test_its_memory_is_locked(machine: Machine) -> None:
    locked = machine.run("grep VmLck /proc/$(pgrep -x ecdaqd)/status").split()
    assert int(locked[1]) > 0


def test_no_interrupt_but_the_timer_comes_to_that_core(machine: Machine) -> None:
    """Device interrupts go to the housekeeping core; those the kernel manages itself may name
    others, but goes nowhere else (isolcpus=managed_irq)."""
    lists = machine.run(
        "for i in /proc/irq/[0-9]*; do echo ${i##*/} $(cat $i/effective_affinity_list); done"
    )
    assert [line for line in lists.splitlines() if line.split()[1:] not in ([], ["0"])] == []


def test_systemd_watches_the_master_with_ten_seconds(machine: Machine) -> None:
    assert machine.run("systemctl show --property=WatchdogUSec --value ecdaqd").strip() == "10s"


def test_a_killed_master_is_restarted(machine: Machine) -> None:
    was = machine.run("pgrep -x ecdaqd").strip()
    machine.run("sudo kill -KILL " + was)
    wait_for(
        "another ecdaqd", 300, lambda: machine.try_run(f"pgrep -x ecdaqd | grep -v {was}").stdout
    )
    wait_for("OP again", OP_S, lambda: machine.status().get("state") == "OP")
