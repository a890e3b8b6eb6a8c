# SPDX-License-Identifier: MIT
"""Commands from a PC to the outputs: one reply each, reverted when the commander dies."""

from __future__ import annotations

import itertools
import json
import statistics
from collections.abc import Callable
from typing import Any

import pytest
from bench import DDS_SETTINGS, Bench, Commander, is_passing, live, wait_for
from flags import SKIPPED, UNANSWERED

LED = "piccolo0.led"
# Long enough for a lease of a second, the longest: a commander that a busy machine does not run for
# a while is not to be taken for dead.
TIMEOUT_MS = 2000
REMOTE_LED = {
    "outputs[0].channel": LED,
    "outputs[0].owner": "remote",
    "outputs[0].timeout": f"{TIMEOUT_MS}ms",
}


def cycles_of(bench: Bench) -> list[Any]:
    """The first slave's samples, as recorded."""
    return list(live.recorded(bench.segment.record_dir, "/ecdaq/piccolo0"))


def end(bench: Bench) -> None:
    bench.segment.stop("daemon")
    assert bench.segment.stop("recorder") == 0
    assert bench.segment.stop("dds") == 0


def test_answer_names_the_first_cycle_that_came_back_with_the_value(
    make_bench: Callable[..., Bench],
) -> None:
    """A frame that a busy machine loses is sent again with the same value in the next cycle."""
    output = "piccolo0.oneshot_time"  # not used by a slave with periodic SYNC0
    bench = make_bench(**REMOTE_LED | {"outputs[0].channel": output})
    bench.start_all()
    commander = bench.commander()
    # Each command has a value of its own: neither fail-safe nor another command gives it.
    answers: dict[int, dict[str, Any]] = {}
    numbers = itertools.count(1)

    def next_accepted() -> bool:
        value = next(numbers)
        answer = commander.command({output: value})
        assert answer["accepted"] or is_passing(answer), answer
        if answer["accepted"]:
            answers[value] = answer
        return answer["accepted"]

    for _ in range(100):
        wait_for("accepted command", next_accepted, 60)
    end(bench)
    first: dict[int, int] = {}
    for m in cycles_of(bench):
        if not m.flags & UNANSWERED:
            first.setdefault(m.oneshot_time, m.cycle)
    named = {value: answer["cycle"] for value, answer in answers.items()}
    assert {value: first.get(value) for value in named} == named
    took = sorted(answer["ms"] for answer in answers.values())
    print(
        f"command to answer on the PC, in cycles of 1 ms, {len(took)} commands: "
        f"median {statistics.median(took):.1f}, p99 {took[-2]:.1f}, most {took[-1]:.1f}"
    )


def test_a_repeated_command_gets_the_same_answer_and_is_executed_once(
    make_bench: Callable[..., Bench],
) -> None:
    output = "piccolo0.oneshot_time"
    bench = make_bench(**REMOTE_LED | {"outputs[0].channel": output})
    bench.start_all()
    commander = bench.commander()
    number = 1000

    def first_accepted() -> dict[str, Any]:
        nonlocal number
        number += 1
        answer = commander.command({output: 1}, id=number)
        assert answer["accepted"] or is_passing(answer), answer
        return answer if answer["accepted"] else {}

    first = wait_for("accepted command", first_accepted, 60)
    # The value tells whether it was executed; a commander would not change it.
    again = commander.command({output: 2}, id=number)
    assert (again["accepted"], again["cycle"]) == (True, first["cycle"])
    refused = commander.settled({"piccolo0.adc": 1}, id=number + 1)
    again = commander.settled({output: 2}, id=number + 1)
    assert not again["accepted"] and again["reason"] == refused["reason"]
    end(bench)
    seen = {m.oneshot_time for m in cycles_of(bench)}
    assert 1 in seen and 2 not in seen


def hold_led(bench: Bench, commander: Commander) -> None:
    """Returns when the LED has been on for 1000 cycles, and is on.

    A commander that does not run for 200 ms may miss its lease of a second, and loses its outputs.
    """
    for _ in range(10):
        commander.accepted({LED: 1})
        bench.segment.wait_for_cycles(1000, 30)
        sample = bench.segment.ecdaq("watch", "--json", "--count", "1", LED).stdout
        if json.loads(sample.splitlines()[-1])["values"][LED]:
            return
    raise AssertionError("the output is not held while its commander lives")


def last_on(samples: list[Any]) -> int:
    """Off for good after that cycle; before, it may have been off while the bus was not in OP."""
    return max(m.cycle for m in samples if m.led)


def test_commander_killed_leaves_its_output_fail_safe_within_the_time_out(
    make_bench: Callable[..., Bench],
) -> None:
    bench = make_bench(**REMOTE_LED)
    bench.start_all()
    commander = bench.commander()
    hold_led(bench, commander)
    commander.kill()
    dead_at = bench.segment.status()["cycle_number"]
    bench.segment.wait_for_cycles(TIMEOUT_MS + 500, 60)
    end(bench)
    samples = cycles_of(bench)
    on = last_on(samples)
    print(f"commander dead by cycle {dead_at}, on until {on}, time-out {TIMEOUT_MS}")
    assert on < dead_at + TIMEOUT_MS < samples[-1].cycle


def test_publisher_killed_leaves_the_output_fail_safe_and_its_successor_does_not_bring_it_back(
    make_bench: Callable[..., Bench],
) -> None:
    bench = make_bench(**REMOTE_LED)
    bench.start_all()
    commander = bench.commander()
    hold_led(bench, commander)
    bench.segment.processes["dds"].kill()
    bench.segment.processes.pop("dds").wait(10)
    dead_at = bench.segment.status()["cycle_number"]
    bench.segment.wait_for_cycles(TIMEOUT_MS + 500, 60)
    bench.start_dds(sessions=2)
    bench.segment.wait_for_cycles(1000, 30)
    end(bench)
    samples = cycles_of(bench)
    # The master sees the last heartbeat in its first step after the kill at the latest. The step in
    # which the time-out is over chooses the fail-safe value, which goes out with the next frame.
    steps = [m.cycle for m in samples if not m.flags & SKIPPED]
    seen = min(cycle for cycle in steps if cycle > dead_at)
    over = min(cycle for cycle in steps if cycle > seen + TIMEOUT_MS)
    on = last_on(samples)
    print(f"ecdaq-dds dead by cycle {dead_at}, on until {on}, {on - dead_at} cycles later")
    assert on <= over < samples[-1].cycle - 1000


def test_wrong_commands_are_refused_with_their_reason_and_never_reach_the_bus(
    make_bench: Callable[..., Bench],
) -> None:
    bench = make_bench(**REMOTE_LED)
    bench.start_all()
    commander = bench.commander()
    start = commander.accepted({LED: 0})
    for values, more, reason in (
        ({"piccolo1.led": 1}, {}, "owned by local, not remote"),
        ({LED: 1, "piccolo1.led": 1}, {}, "owned by local, not remote"),
        ({"piccolo0.adc": 1}, {}, "is an input"),
        ({"nobody.led": 1}, {}, "no such channel"),
        ({LED: 7}, {}, "not a value of type BOOL"),
        ({LED: 0.4}, {}, "not a value of type BOOL"),
        ({LED: 2}, {"raw": True}, "does not fit in 1 bits"),
        ({LED: 1}, {"session": 5}, "stale"),
        ({LED: 1}, {"not_after_cycle": 1}, "stale"),
        ({}, {}, "0 channels"),
        ({LED: 1}, {"id": 1}, "stale"),
    ):
        answer = commander.settled(values, **more)
        assert not answer["accepted"], (values, more, answer)
        assert reason in answer["reason"], answer
    last = commander.accepted({LED: 0})
    end(bench)
    between = [m for m in cycles_of(bench) if start <= m.cycle <= last]
    assert between and not any(m.led for m in between)


def test_commands_are_off_unless_allowed(make_bench: Callable[..., Bench]) -> None:
    bench = make_bench(**REMOTE_LED, **{"dds.allow_insecure_commands": "off"})
    bench.start_all()
    answer = bench.commander().settled({LED: 1})
    assert not answer["accepted"]
    assert "commands are disabled" in answer["reason"]


@pytest.mark.parametrize(
    ("settings", "reason"),
    [
        ({"dds.interface": "ecat0"}, "is bus.interface"),
        ({"dds.interface": "nowhere0"}, "nowhere0: no such network interface"),
        ({"dds.interface": ""}, "is required"),
        ({"dds.interface": 'lo"/><x'}, "is not the name of a network interface"),
        ({"dds.peers": "10.0.0.1 <"}, "must be addresses"),
    ],
)
def test_publisher_starts_on_a_named_interface_of_its_own_only(
    make_bench: Callable[..., Bench], settings: dict[str, str], reason: str
) -> None:
    bench = make_bench()
    given = DDS_SETTINGS | {"bus.interface": "ecat0"} | settings
    options = [word for item in given.items() for word in ("--set", "=".join(item))]
    ended = bench.segment.space.run(str(live.BIN / "ecdaq-dds"), *options, check=False)
    assert ended.returncode == 3
    assert reason in ended.stderr


def test_publisher_refuses_the_nic_that_the_running_master_has(
    make_bench: Callable[..., Bench],
) -> None:
    bench = make_bench()
    bench.segment.start_all()
    ended = bench.segment.space.run(
        str(live.BIN / "ecdaq-dds"), "--run-dir", str(bench.segment.run_dir),
        "--set", "dds.enable=on", "--set", "dds.interface=ecat0", check=False,
    )  # fmt: skip
    assert ended.returncode == 3
    assert "ecat0: in use for the EtherCAT segment" in ended.stderr
