# SPDX-License-Identifier: MIT
"""SYNC0 on lines of gpio-sim, in guest time: errors of a chip or a line, and a wire as exact as
the emulator's clock: missing pulses are reported with their exact cycle, and nothing else.

The simulated segment, in the machine, writes its edges into a pipe; sim_wire.pl pulls the lines.
"""

from __future__ import annotations

import base64
import json
from pathlib import Path
from typing import Any

from machine import Machine, profile, wait_for
from wire import NS_PER_MS, Books

CHIP = "sync-bank"
SYNC0 = f"""sync0:
  enable: on
  window: 2s
  jitter_limit: 1ms
  phase_limit: 900us
  skew_limit: 900us
slaves:
  - sync0_line: {CHIP}:0
  - sync0_line: SYNC_B
"""
BOOT_FILES = {"ecdaq.yaml": profile("guest") + SYNC0}
OP_S = 900
WINDOWS_S = 900
PERIOD_NS = NS_PER_MS
PULSES = ("sync0_missing", "sync0_extra", "sync0_lost", "sync0_back")
KEPT = (1, 3, 150)  # pulses, of slaves 1, 0 and 1: the last lasts beyond sync0.lost
NO_HARM = ("frames_lost", "frames_late", "overruns", "cycles_skipped", "samples_bad", "dc_unlocks")
PERL = (Path(__file__).parent / "sim_wire.pl").read_bytes()
CONFIGFS = "/sys/kernel/config/gpio-sim/ecdaq"
CONFIG = "--config /run/ecdaq-boot/ecdaq.yaml"
PLACE = "/run/wire"
PLUG = f"""set -e
modprobe gpio-sim
mountpoint -q /sys/kernel/config || mount -t configfs none /sys/kernel/config
mkdir -p {CONFIGFS}/bank0/line0 {CONFIGFS}/bank0/line1 {CONFIGFS}/bank0/line3/hog
echo 8 > {CONFIGFS}/bank0/num_lines
echo {CHIP} > {CONFIGFS}/bank0/label
echo SYNC_A > {CONFIGFS}/bank0/line0/name
echo SYNC_B > {CONFIGFS}/bank0/line1/name
echo w1-gpio > {CONFIGFS}/bank0/line3/hog/name
echo input > {CONFIGFS}/bank0/line3/hog/direction
echo 1 > {CONFIGFS}/live
"""
SEGMENT = f"""[Service]
ReadWritePaths={PLACE}
ExecStart=
ExecStart=/usr/bin/ecdaq-sim --interface ecsim0 --slaves 2 --priority 60 \
--edges {PLACE}/edges --control {PLACE}/control
"""
DUMP = f"""[Service]
ExecStart=
ExecStart=/usr/bin/ecdaq-sync0 {CONFIG} $ECDAQ_OPTIONS --dump /run/ecdaq/sync0/dump
"""


def put(machine: Machine, path: str, content: bytes) -> None:
    """A file in the machine, with its folder."""
    text = base64.b64encode(content).decode()
    folder = str(Path(path).parent)
    machine.run(f"sudo mkdir -p {folder}; echo {text} | base64 -d | sudo tee {path} > /dev/null")


def root(machine: Machine, script: str) -> str:
    """A script run by root."""
    text = base64.b64encode(script.encode()).decode()
    return machine.run(f"echo {text} | base64 -d | sudo sh")


def sync0_events(machine: Machine) -> list[dict[str, Any]]:
    lines = machine.run("ecdaq events --json").splitlines()
    return [e for e in map(json.loads, lines) if e["event"].startswith("sync0_")]


def journal_lines(machine: Machine, words: str) -> list[str]:
    """What ecdaq-sync0 wrote to the journal with @words in it."""
    journal = machine.run("sudo journalctl --boot --unit=ecdaq-sync0 --output=cat --no-pager")
    return [line for line in journal.splitlines() if words in line]


def wait_for_op(machine: Machine) -> dict[str, Any]:
    wait_for("OP", OP_S, lambda: machine.status().get("state") == "OP")
    return machine.status()


def wait_for_lines(machine: Machine, *open_ones: int) -> None:
    """Until these lines, and no others, are open."""

    def found() -> bool:
        lines = machine.sync0().get("lines", [])
        return len(lines) == 2 and [n for n in (0, 1) if lines[n]["open"]] == list(open_ones)

    wait_for(f"lines {open_ones} open", WINDOWS_S, found)


def wait_for_windows(machine: Machine, count: int) -> dict[str, Any]:
    """Asked inside: each login costs the machine more than the window does."""
    machine.run(
        "until ecdaq sync0 --json | grep '\"running\":true' |"
        " grep -Eo '\"windows\":[0-9]+' | cut -d : -f 2 |"
        f" (read n && [ $n -ge {count} ]); do sleep 0.5; done",
        seconds=WINDOWS_S,
    )
    return machine.sync0()


def carry(machine: Machine, *pairs: str) -> None:
    """Wire slaves to lines: "0=0+1" wires slave 0 to both."""
    folder = "/sys/devices/platform/gpio-sim.0"
    words = [
        f"{slave}={'+'.join(f'{folder}/*/sim_gpio{n}/pull' for n in lines.split('+'))}"
        for slave, lines in (pair.split("=") for pair in pairs)
    ]
    root(
        machine,
        "systemctl stop wire 2> /dev/null\n"
        f"chip=$(cat {CONFIGFS}/bank0/chip_name)\n"
        "systemd-run --quiet --unit=wire --collect --property=CPUSchedulingPolicy=fifo"
        " --property=CPUSchedulingPriority=55"
        f" perl {PLACE}/wire.pl carry {PLACE}/edges {PLACE}/log "
        + " ".join(words).replace("/*/", "/$chip/")
        + "\n",
    )


def by_hand(machine: Machine, line: str, who: str = "sudo") -> list[str]:
    """What a second ecdaq-sync0, started by hand, reports of a line for slave 0."""
    result = machine.try_run(
        f"rm -rf /tmp/other; mkdir /tmp/other; {who} timeout 2 ecdaq-sync0 --run-dir /tmp/other"
        f" --set sync0.enable=on --set slaves[0].sync0_line={line} 2>&1"
    )
    assert result.returncode == 124, result
    return [x for x in result.stdout.splitlines() if "calibrat" not in x]


def baseline(machine: Machine) -> Path:
    """The master's status when everything was up."""
    return machine.folder / "baseline.json"


def grown_since(machine: Machine, before: dict[str, Any]) -> dict[str, int]:
    after = machine.status()
    assert (after["pid"], after["state"]) == (before["pid"], "OP")
    assert after["recorded_gaps"] == 0
    return {name: after[name] - before[name] for name in (*NO_HARM, "cycles")}


def test_a_missing_chip_is_one_line_for_each_slave_and_the_master_runs(machine: Machine) -> None:
    wait_for_op(machine)
    wait_for("its state", WINDOWS_S, lambda: machine.sync0().get("state") == "no line")
    machine.run("sleep 6")  # three more tries
    journal = journal_lines(machine, "of slave")
    print("\n" + "\n".join(journal))
    assert journal == [
        f"ecdaq-sync0: line '{CHIP}:0' of slave 0: no chip of this label; there are: 9030000.pl061",
        "ecdaq-sync0: line 'SYNC_B' of slave 1: no line of this name on: 9030000.pl061",
    ]
    assert "NOT OPEN" in machine.run("ecdaq sync0")
    assert machine.status()["state"] == "OP"


def test_a_chip_that_appears_later_is_opened_automatically(machine: Machine) -> None:
    root(machine, PLUG)
    wait_for_lines(machine, 0, 1)
    assert machine.sync0()["message"] == ""
    print("\n" + machine.run("sudo gpioinfo"))


def test_edges_of_the_segment_are_assigned_to_cycles_and_uncalibrated_is_unresolved(
    machine: Machine,
) -> None:
    put(machine, f"{PLACE}/wire.pl", PERL)
    put(machine, "/run/systemd/system/ecdaq-segment.service.d/wire.conf", SEGMENT.encode())
    put(machine, "/run/systemd/system/ecdaq-sync0.service.d/dump.conf", DUMP.encode())
    root(machine, f"chmod 777 {PLACE}; mkfifo -m 666 {PLACE}/edges; systemctl daemon-reload")
    carry(machine, "0=0", "1=1")
    root(
        machine,
        "systemctl stop ecdaqd; systemctl restart ecdaq-segment; systemctl start ecdaqd\n"
        "systemctl restart ecdaq-sync0\n",
    )
    baseline(machine).write_text(json.dumps(wait_for_op(machine)))
    found = wait_for_windows(machine, 2)
    print("\n" + machine.run("ecdaq sync0; ecdaq sync0 --histogram"))
    print("\n".join(e["text"] for e in sync0_events(machine)))
    for line in found["lines"]:
        # The emulator may have been late with one by a quarter of a cycle while all this started.
        assert line["missing"] == line["extra"] <= 2, line
        assert line["window"]["checks"]["count"] == "OK"
    assert found["lines"][1]["window"]["checks"]["skew"] == "UNRESOLVED"
    # The same delay can be a step of the phase in the first two windows, but not later.
    found = wait_for_windows(machine, 4)
    assert [line["window"]["checks"]["phase"] for line in found["lines"]] == ["UNRESOLVED"] * 2


def test_one_signal_on_two_lines_calibrates_the_board(machine: Machine) -> None:
    root(machine, "systemctl stop ecdaq-sync0")
    carry(machine, "0=0+1")
    text = machine.run(f"sudo ecdaq {CONFIG} sync0 calibrate", seconds=1800)
    print("\n" + text + machine.run("cat /var/lib/ecdaq/sync0-calibration"))
    carry(machine, "0=0", "1=1")
    root(machine, "systemctl start ecdaq-sync0")
    found = wait_for_windows(machine, 2)
    assert found["noise_p99_ns"] > 0
    print(machine.run("ecdaq sync0"))
    assert [line["window"]["checks"]["phase"] for line in found["lines"]] == ["OK", "OK"]
    assert found["lines"][1]["window"]["checks"]["skew"] == "OK"


def test_a_suppressed_pulse_is_reported_with_its_cycle_and_nothing_else_is(
    machine: Machine,
) -> None:
    root(machine, f"systemctl stop ecdaq-sync0; systemctl restart wire; : > {PLACE}/log")
    carry(machine, "0=0", "1=1")
    root(machine, "systemctl start ecdaq-sync0")
    wait_for_windows(machine, 1)
    for slave, count in zip((1, 0, 1), KEPT, strict=True):
        answer = machine.run(
            f"sudo perl {PLACE}/wire.pl send {PLACE}/control"
            f" 'at=0s sync0-lost slave={slave} count={count}'"
        )
        assert answer.strip() == "ok"
        wait_for_windows(machine, machine.sync0()["windows"] + 2)
    # A step of the phase by the emulator's turns, 0.2 ms, is reported, too: pulses are checked.
    events = [e for e in sync0_events(machine) if e["event"] in PULSES]
    last = machine.sync0()
    root(machine, "systemctl stop ecdaq-sync0 wire")
    books = Books(
        machine.run(f"cat {PLACE}/log"), machine.run("cat /run/ecdaq/sync0/dump"), PERIOD_NS
    )
    carry(machine, "0=0", "1=1")
    root(machine, "systemctl start ecdaq-sync0")
    newest = max(e["value"] for e in events)
    kept = {s: [c for c in books.silent(s, other) if c <= newest] for s, other in ((0, 1), (1, 0))}
    print(f"\nsuppressed: slave 0 {kept[0]}, slave 1 {kept[1]}")
    print("\n".join(e["text"] for e in events))
    for slave in (0, 1):
        late = sorted(abs(x) for x in books.lateness_ns[slave].values())
        print(
            f"slave {slave}: {len(late)} edges off by p50 {late[len(late) // 2]:.0f} ns,"
            f" p99 {late[len(late) * 99 // 100]:.0f} ns, max {late[-1]:.0f} ns"
        )
        assert books.invented(slave) == [] and books.merged[slave] == 0
        assert books.dropped(slave) == 0
    assert (len(kept[0]), len(kept[1])) == (3, 151)
    assert [
        (e["event"], e["slave"], e["value"], e["arg"][0])
        for e in events
        if e["event"] != "sync0_lost"
    ] == [
        ("sync0_missing", 1, kept[1][0], 1),
        ("sync0_missing", 0, kept[0][0], 3),
        ("sync0_back", 1, kept[1][-1] + 1, 150),
    ]
    lost = [(e["slave"], e["value"]) for e in events if e["event"] == "sync0_lost"]
    assert lost == [(1, kept[1][1])]
    assert [line["missing"] for line in last["lines"]] == [3, 151]
    assert [line["extra"] for line in last["lines"]] == [0, 0]


def test_restarting_and_killing_the_check_costs_the_master_nothing(machine: Machine) -> None:
    before = machine.status()
    for harm in ("systemctl restart ecdaq-sync0", "kill -KILL $(pgrep -x ecdaq-sync0)"):
        was = machine.sync0()["pid"]
        root(machine, harm)
        wait_for(
            "another ecdaq-sync0", WINDOWS_S, lambda was=was: machine.sync0().get("pid") != was
        )
        wait_for_windows(machine, 1)
    grown = grown_since(machine, before)
    print(f"\nguest time: {grown}")
    assert grown.pop("cycles") > 4000
    assert grown == dict.fromkeys(NO_HARM, 0)


def test_a_line_in_use_a_wrong_name_and_a_wrong_number_are_one_line_each(machine: Machine) -> None:
    labels = ("9030000.pl061", CHIP)
    why = {
        f"{CHIP}:3": ["already used by w1-gpio"],
        f"{CHIP}:0": ["already used by ecdaq-sync0"],
        "9030000.pl061:3": ["already used by GPIO Key Poweroff"],
        "SYNC_X": [f"no line of this name on: {a}, {b}" for a, b in (labels, labels[::-1])],
        f"{CHIP}:8": [f"chip {CHIP} has lines 0 to 7 only"],
        "pinctrl-bcm2711:17": [
            f"no chip of this label; there are: {a}, {b}" for a, b in (labels, labels[::-1])
        ],
    }
    for line, reasons in why.items():
        lines = by_hand(machine, line)
        print("\n".join(lines))
        assert lines in [[f"ecdaq-sync0: line '{line}' of slave 0: {why}"] for why in reasons]


def test_a_missing_permission_for_a_chip_is_reported(machine: Machine) -> None:
    """A user without permission, and the service when the udev rule is missing."""
    no_right = "no permission to open /dev/gpiochip*: be root or in their group"
    assert by_hand(machine, f"{CHIP}:0", who="") == [
        f"ecdaq-sync0: line '{CHIP}:0' of slave 0: {no_right}"
    ]
    assert machine.run("stat -c %U /dev/gpiochip*").split() == ["ecdaq-sync0"] * 2
    machine.run("sudo chown root /dev/gpiochip*; sudo systemctl restart ecdaq-sync0")
    wait_for("its state", WINDOWS_S, lambda: machine.sync0().get("state") == "no line")
    assert no_right in machine.sync0()["message"]
    assert len(journal_lines(machine, no_right)) == 2
    machine.run("sudo udevadm trigger --settle --action=change --subsystem-match=gpio")
    wait_for_lines(machine, 0, 1)


def test_an_unplugged_chip_is_reported_and_opened_again_when_it_is_back(machine: Machine) -> None:
    wait_for_windows(machine, 1)
    root(machine, f"systemctl stop wire; echo 0 > {CONFIGFS}/live")
    wait_for_lines(machine)
    wait_for("its state", WINDOWS_S, lambda: machine.sync0().get("state") == "no line")
    gone = journal_lines(machine, "its chip is gone")
    print("\n" + "\n".join(gone))
    assert sorted(gone) == [
        "ecdaq-sync0: line 'SYNC_B' of slave 1: its chip is gone",
        f"ecdaq-sync0: line '{CHIP}:0' of slave 0: its chip is gone",
    ]
    root(machine, f"echo 1 > {CONFIGFS}/live")
    carry(machine, "0=0", "1=1")
    wait_for_lines(machine, 0, 1)
    found = wait_for_windows(machine, 2)
    assert [line["window"]["missing"] for line in found["lines"]] == [0, 0]


def test_the_master_lost_no_cycle_meanwhile(machine: Machine) -> None:
    grown = grown_since(machine, json.loads(baseline(machine).read_text()))
    print(f"\nguest time: {grown}")
    assert grown.pop("cycles") > 15000
    # A slave without its SYNC0 is marked in its samples.
    assert grown.pop("samples_bad") <= sum(KEPT)
    assert not any(grown.values()), grown
    assert machine.run("systemctl show --property=NRestarts --value ecdaqd").strip() == "0"
