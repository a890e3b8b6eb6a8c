# SPDX-License-Identifier: MIT
"""The bus comes to OP by itself, on its own core, and every cycle is recorded.

The guest's clock counts instructions (-icount), so that a cycle of 1 ms holds whatever the host
does; all times are guest time. The emulator's processors take turns: waiting for the frame has to
give the turn away (cycle.poll: sleep).
"""

from __future__ import annotations

from machine import Machine, wait_for

IN_GUEST_TIME = True
BOOT_FILES = {"ecdaq.yaml": "dc:\n  burst_frames: 500\ncycle:\n  receive: 70%\n  poll: sleep\n"}
OP_S = 300


def in_operation(machine: Machine) -> bool:
    result = machine.try_run("ecdaq status --json")
    return result.returncode == 0 and machine.json("ecdaq status --json").get("state") == "OP"


def test_two_slaves_come_to_op_without_a_hand_on_it(machine: Machine) -> None:
    wait_for("OP", OP_S, lambda: in_operation(machine))
    status = machine.json("ecdaq status --json")
    assert status["slaves"] == 2
    assert status["rt_degraded"] == []
    assert status["cycle_cpu"] == 1


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


def test_the_cycle_goes_on_and_is_recorded(machine: Machine) -> None:
    before = machine.json("ecdaq status --json")["cycles"]
    wait_for("3,000 cycles more", OP_S, lambda: cycles(machine) > before + 3000)
    status = machine.json("ecdaq status --json")
    assert status["recorded_gaps"] == 0
    assert machine.run("sudo find /data/record -name '*.mcap*' -size +4k").strip()


def cycles(machine: Machine) -> int:
    return int(machine.json("ecdaq status --json")["cycles"])


def test_a_killed_master_comes_back_by_itself(machine: Machine) -> None:
    was = machine.run("pgrep -x ecdaqd").strip()
    machine.run("sudo kill -KILL " + was)
    wait_for(
        "another ecdaqd", 60, lambda: machine.try_run(f"pgrep -x ecdaqd | grep -v {was}").stdout
    )
    wait_for("OP again", OP_S, lambda: in_operation(machine))
