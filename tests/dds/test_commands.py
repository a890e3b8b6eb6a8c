# SPDX-License-Identifier: MIT
"""Commands from a PC to the outputs: one reply each, reverted when the commander dies."""

from __future__ import annotations

import itertools
import statistics
from collections.abc import Callable

import pytest
from bench import DDS_SETTINGS, Bench, live
from flags import SKIPPED

LED = "piccolo0.led"
# Long enough for a lease of a second, the longest: a commander that a busy machine does not run for
# a while is not to be taken for dead.
TIMEOUT_MS = 2000
REMOTE_LED = {
    "outputs[0].channel": LED,
    "outputs[0].owner": "remote",
    "outputs[0].timeout": f"{TIMEOUT_MS}ms",
}


def led_by_cycle(bench: Bench) -> dict[int, bool]:
    return {m.cycle: m.led for m in live.recorded(bench.segment.record_dir, "/ecdaq/piccolo0")}


def sent_cycles(bench: Bench) -> set[int]:
    """Those with a frame: a cycle that the master skipped has a sample, but nothing was sent."""
    recorded = live.recorded(bench.segment.record_dir, "/ecdaq/piccolo0")
    return {m.cycle for m in recorded if not m.flags & SKIPPED}


def end(bench: Bench) -> None:
    bench.segment.stop("daemon")
    assert bench.segment.stop("recorder") == 0
    assert bench.segment.stop("dds") == 0


def test_answer_names_the_very_cycle_whose_frame_carried_the_value(
    make_bench: Callable[..., Bench],
) -> None:
    bench = make_bench(**REMOTE_LED)
    bench.start_all()
    commander = bench.commander()
    sent_values = [(k % 2, commander.command({LED: k % 2})) for k in range(1, 101)]
    pairs = list(itertools.pairwise([(0, {"accepted": True}), *sent_values]))
    answers = [(value, answer) for value, answer in sent_values if answer["accepted"]]
    # A master that a busy machine does not run for 200 ms reports it, and reverts the value.
    assert all(
        answer["accepted"] or "not taken by the master in time" in answer["reason"]
        for _, answer in sent_values
    ), sent_values
    assert len(answers) > 90
    end(bench)
    led = led_by_cycle(bench)
    sent = sent_cycles(bench)
    for (_, last), (value, answer) in pairs:
        if not (answer["accepted"] and last["accepted"]):
            continue
        cycle = answer["cycle"]
        assert cycle in sent and led[cycle] == value, answer
        before = next(k for k in range(cycle - 1, 0, -1) if k in sent)
        assert led[before] != value, (before, answer)
    took = sorted(answer["ms"] for _, answer in answers)
    print(
        f"command to answer on the PC, in cycles of 1 ms, {len(took)} commands: "
        f"median {statistics.median(took):.1f}, p99 {took[-2]:.1f}, most {took[-1]:.1f}"
    )


def test_commander_killed_leaves_its_output_fail_safe_within_the_time_out(
    make_bench: Callable[..., Bench],
) -> None:
    bench = make_bench(**REMOTE_LED)
    bench.start_all()
    commander = bench.commander()
    set_at = commander.accepted({LED: 1})
    bench.segment.wait_for_cycles(1000, 30)  # it lives
    killed_at = bench.segment.status()["cycle_number"]  # no later than the kill
    commander.kill()
    dead_at = bench.segment.status()["cycle_number"]
    bench.segment.wait_for_cycles(TIMEOUT_MS + 500, 60)
    end(bench)
    led = led_by_cycle(bench)
    off = min(cycle for cycle in led if cycle > set_at and not led[cycle])
    print(
        f"set in cycle {set_at}, killed from {killed_at} on, fail-safe from {off}: "
        f"{off - killed_at} cycles later, time-out {TIMEOUT_MS}"
    )
    assert off > set_at + 1000
    assert off - dead_at <= TIMEOUT_MS
    assert not any(led[cycle] for cycle in led if cycle >= off)


def test_publisher_killed_leaves_the_output_fail_safe_and_its_successor_does_not_bring_it_back(
    make_bench: Callable[..., Bench],
) -> None:
    timeout = 500
    bench = make_bench(**REMOTE_LED | {"outputs[0].timeout": f"{timeout}ms"})
    bench.start_all()
    commander = bench.commander()
    set_at = commander.accepted({LED: 1})
    bench.segment.processes["dds"].kill()
    bench.segment.processes.pop("dds").wait(10)
    # The status page is up to 20 ms old: only the next one was written after the kill.
    killed_at = bench.segment.wait_for_cycles(1, 30)["cycle_number"]
    bench.segment.wait_for_cycles(1000, 30)
    bench.start_dds(sessions=2)
    bench.segment.wait_for_cycles(1000, 30)
    end(bench)
    led = led_by_cycle(bench)
    off = min(cycle for cycle in led if cycle > set_at and not led[cycle])
    print(f"ecdaq-dds killed by {killed_at}, fail-safe from {off}: {off - killed_at} cycles later")
    assert off - killed_at <= timeout + 5
    assert not any(led[cycle] for cycle in led if cycle >= off)


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
        ({LED: 7}, {}, "outside the range of the channel"),
        ({LED: 2}, {"raw": True}, "does not fit in 1 bits"),
        ({LED: 1}, {"session": 5}, "stale"),
        ({LED: 1}, {"not_after_cycle": 1}, "stale"),
        ({}, {}, "0 channels"),
        ({LED: 1}, {"id": 1}, "stale"),
    ):
        answer = commander.command(values, **more)
        assert not answer["accepted"], (values, more, answer)
        assert reason in answer["reason"], answer
    last = commander.accepted({LED: 0})
    end(bench)
    led = led_by_cycle(bench)
    assert not any(led[cycle] for cycle in range(start, last + 1))


def test_commands_are_off_unless_allowed(make_bench: Callable[..., Bench]) -> None:
    bench = make_bench(**REMOTE_LED, **{"dds.allow_insecure_commands": "off"})
    bench.start_all()
    answer = bench.commander().command({LED: 1})
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
