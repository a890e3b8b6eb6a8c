# SPDX-License-Identifier: MIT
"""From an unknown bus to a configuration, and back: scan, config diff, pdo on a real ecdaqd."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

from bus import tell
from segment import Segment, wait_for

# Without mailbox, with CoE, with more PDOs than are assigned, with a fixed mapping.
SLAVES = "fb1111_piccolo,ek1100,el1004,el2004,el3004,el5101"
OK, FAILED, SLAVES_DIFFER = 0, 1, 9


def waiting(segment: Segment, state: str) -> None:
    wait_for(state, lambda: segment.status().get("state") == state, 60)


def test_a_scan_is_a_configuration_that_brings_the_same_bus_to_op(
    make_segment: Callable[..., Segment],
) -> None:
    segment = make_segment(slaves=SLAVES, settings={"bus.target": "preop"})
    file = segment.folder / "ecdaq.yaml"
    segment.start_sim()
    segment.start_waiting_daemon()
    waiting(segment, "PREOP")
    segment.ecdaq("scan", "--write", str(file))
    text = file.read_text()
    names = [line.split()[-1] for line in text.splitlines() if line.startswith("  - name:")]
    found = json.loads(segment.ecdaq("scan", "--json").stdout)
    assert names == [slave["name"] for slave in found]
    assert "TxPDO 0x1a00 SM3" in text and "not assigned" in text
    assert segment.ecdaq("config", "check", str(file)).stdout == f"{file}: valid\n"
    refused = segment.ecdaq("scan", "--write", str(file), check=False)
    assert refused.returncode == FAILED
    assert "exists: --force replaces it" in refused.stderr
    segment.ecdaq("scan", "--write", str(file), "--force")
    assert segment.stop("daemon") == 0

    del segment.settings["bus.target"]
    segment.start_daemon("--config", str(file))
    segment.wait_for_op()
    assert segment.ecdaq("config", "diff").stdout == "configuration and bus agree\n"
    again = segment.ecdaq("scan").stdout
    assert '#  - { match: "0x7000:01", name: led }  # output BOOL' in again
    # Its channel lists, with the comments taken off, change nothing.
    file.write_text(again.replace("    #channels:", "    channels:").replace("    #  -", "      -"))
    before = segment.ecdaq("channels").stdout
    assert segment.stop("daemon") == 0
    segment.start_daemon("--config", str(file))
    segment.wait_for_op()
    assert segment.ecdaq("channels").stdout == before
    identity = [line for line in text.splitlines() if "#" not in line]
    assert [line for line in again.splitlines() if "#" not in line] == identity
    assert segment.stop("daemon") == 0


CHANNELS = """slaves:
  - name: front
    channels:
      - { match: adc, name: pressure_behind_the_second_valve_of_the_left_line,
          unit: bar, scale: 0.5, offset: -1, min: 5000 }
      - { match: "0x6000:02", name: turns }
outputs:
  - { channel: front.led, fail_safe: 1 }
"""
PRESSURE = "front.pressure_behind_the_second_valve_of_the_left_line"


def test_channels_have_the_name_the_unit_and_the_scale_of_the_file(
    make_segment: Callable[..., Segment],
) -> None:
    segment = make_segment(slaves="1")
    file = segment.folder / "ecdaq.yaml"
    file.write_text(CHANNELS)
    segment.start_sim()
    segment.start_daemon("--config", str(file))
    segment.wait_for_op()
    channels = {one["name"]: one for one in json.loads(segment.ecdaq("channels", "--json").stdout)}
    assert list(channels)[-4:] == [PRESSURE, "front.turns", "front.sample_time", "front.status"]
    pressure = channels[PRESSURE]
    assert (pressure["unit"], pressure["scale"], pressure["offset"]) == ("bar", 0.5, -1)
    assert (pressure["min"], pressure["max"]) == (5000, None)
    assert f"{PRESSURE:28} in   UINT16" in segment.ecdaq("channels").stdout
    one = json.loads(segment.ecdaq("watch", PRESSURE, "--count", "1", "--json").stdout)
    raw = json.loads(segment.ecdaq("watch", PRESSURE, "--count", "1", "--json", "--raw").stdout)
    value = one["values"][PRESSURE]
    assert 0 <= (value + 1) * 2 <= 4095 and (value + 1) * 2 % 1 == 0
    assert 0 <= raw["values"][PRESSURE] <= 4095
    assert one["outside"] == ([] if one["bad"] else [PRESSURE])
    assert f"{PRESSURE}[bar]" in segment.ecdaq("watch", PRESSURE, "--count", "1").stdout
    assert "pressure_behind_the_second_valve_of_the_left_line" in segment.ecdaq("cstruct").stdout
    shown = segment.ecdaq("config", "show").stdout
    assert "unit: bar" in shown
    assert segment.ecdaq("config", "diff").stdout == "configuration and bus agree\n"
    assert segment.stop("daemon") == 0


def test_an_item_that_meets_no_channel_keeps_the_bus_waiting_and_is_named(
    make_segment: Callable[..., Segment],
) -> None:
    segment = make_segment(slaves="1")
    file = segment.folder / "ecdaq.yaml"
    file.write_text("slaves:\n  - name: front\n    channels:\n      - { match: ai_*, unit: V }\n")
    segment.start_sim()
    segment.start_waiting_daemon("--config", str(file))
    wait_for("waiting", lambda: segment.status().get("waiting"), 60)
    assert "channels: ai_*: no such channel; there are: led, oneshot_time, adc, counter" in str(
        segment.status()
    )
    text = wait_for(
        "difference", lambda: segment.ecdaq("config", "diff", check=False).stdout.strip(), 60
    )
    assert text.startswith(f"{file}:4: position 0 front: no such channel: expected ai_*, found led")
    assert segment.stop("daemon") == 0


def differences(segment: Segment) -> list[dict[str, Any]]:
    got = segment.ecdaq("config", "diff", "--json", check=False)
    return json.loads(got.stdout) if got.returncode == SLAVES_DIFFER else []


def write(file: Path, *slaves: str, outputs: str = "") -> None:
    file.write_text("slaves:\n" + "".join(f"  - {{{slave}}}\n" for slave in slaves) + outputs)


def test_every_difference_is_shown_while_the_bus_waits(
    make_segment: Callable[..., Segment],
) -> None:
    segment = make_segment(slaves="ek1100,el1004,el2004")
    file = segment.folder / "ecdaq.yaml"
    write(
        file,
        "name: coupler, vendor: 2, product: 0x044c2c52, alias: 7",
        "name: in, vendor: 2, product: 0x1234",
        "name: out, vendor: 2",
        "name: pump, vendor: 0x99, product: 1",
        outputs="outputs:\n  - channel: nobody.x\n",
    )
    segment.start_sim()
    segment.start_waiting_daemon("--config", str(file))
    wait_for("waiting", lambda: segment.status().get("waiting"), 60)
    # It tries again by itself, but not while somebody looks.
    found = wait_for("differences", lambda: differences(segment), 60)
    assert [(one["kind"], one["name"], one["line"]) for one in found] == [
        ("identity", "coupler", 2),
        ("identity", "in", 3),
        ("missing", "pump", 5),
        ("output", "nobody.x", 7),
    ]
    assert (found[0]["property"], found[0]["expected"], found[0]["found"]) == ("alias", "7", "0")
    assert found[1]["property"] == "device" and "(EL1004" in found[1]["found"]
    text = segment.ecdaq("config", "diff", check=False)
    assert f"{file}:5: slave 3 pump: missing: expected vendor 0x00000099" in text.stdout
    assert text.stderr == "ecdaq: config: 4 differences between configuration and bus\n"
    shown = segment.ecdaq("config", "show").stdout
    assert f"# {file}" in shown and "interface: ecat0" in shown
    assert segment.stop("daemon") == 0


def pdos(segment: Segment) -> dict[str, dict[str, Any]]:
    return {one["name"]: one for one in json.loads(segment.ecdaq("pdo", "--json").stdout)}


def mapped(slave: dict[str, Any], direction: str) -> list[tuple[int, int, int]]:
    """Object and bits of what is assigned, in order, without padding."""
    return [
        (entry["index"], entry["subindex"], entry["bits"])
        for pdo in slave["pdo"]
        if pdo["assigned"] and pdo["direction"] == direction
        for entry in pdo["entry"]
        if entry["index"] != 0
    ]


def test_the_pdos_are_those_that_are_mapped(make_segment: Callable[..., Segment]) -> None:
    segment = make_segment(slaves=SLAVES)
    segment.start_sim()
    segment.start_daemon()
    segment.wait_for_op()
    channels = json.loads(segment.ecdaq("channels", "--json").stdout)
    shown = pdos(segment)
    assert len(shown) == 6
    for name, slave in shown.items():
        own = [ch for ch in channels if ch["name"].startswith(f"{name}.")]
        for direction in ("input", "output"):
            table = [
                (ch["index"], ch["subindex"], ch["bit_length"])
                for ch in own
                if ch["direction"] == direction
            ]
            assert mapped(slave, direction) == table, (name, direction)
    piccolo = next(slave for name, slave in shown.items() if name.startswith("piccolo"))
    assert piccolo["source"] == "coe"
    assert {entry["name"] for pdo in piccolo["pdo"] for entry in pdo["entry"]} >= {"adc", "led"}
    text = segment.ecdaq("pdo", "0").stdout
    assert "SM3 inputs, start 0x1180, 13 bytes" in text
    assert "0x6000:01   16  UINT   adc" in text
    unassigned = [pdo for slave in shown.values() for pdo in slave["pdo"] if not pdo["assigned"]]
    assert unassigned and all(pdo["entry"] for pdo in unassigned)
    assert segment.stop("daemon") == 0


def test_without_a_mailbox_the_pdos_are_those_of_the_sii(
    make_segment: Callable[..., Segment],
) -> None:
    segment = make_segment(slaves="2", settings={"bus.target": "init"})
    segment.start_sim()
    segment.start_waiting_daemon()
    waiting(segment, "INIT")
    piccolo = pdos(segment)["piccolo0"]
    assert piccolo["source"] == "sii"
    assert piccolo["not_by_coe"]
    assert mapped(piccolo, "input")
    assert segment.stop("daemon") == 0


def test_a_lost_answer_is_asked_for_again_and_a_lost_mailbox_is_said_in_a_line(
    make_segment: Callable[..., Segment],
) -> None:
    segment = make_segment(
        slaves="el3104", settings={"bus.target": "preop", "bus.mailbox_timeout": "300ms"}
    )
    file = segment.folder / "ecdaq.yaml"
    control = segment.folder / "control"
    segment.start_sim("--control", str(control))
    segment.start_waiting_daemon()
    waiting(segment, "PREOP")
    (before,) = pdos(segment).values()
    assert tell(control, "at=0s mailbox kind=silent count=1 slave=0") == "ok"
    (after,) = pdos(segment).values()
    assert after == before
    assert (after["source"], after["not_by_coe"]) == ("coe", None)
    assert tell(control, "at=0s mailbox kind=silent count=1000 slave=0") == "ok"
    (silent,) = pdos(segment).values()
    assert silent["source"] == "sii"
    assert "no answer" in silent["not_by_coe"]
    written = segment.ecdaq("scan", "--write", str(file))
    assert "slave 0: PDOs by SII, not by CoE: " in written.stderr
    assert "# PDOs by SII, not by CoE: " in file.read_text()
    assert "slave 0: PDOs by SII, not by CoE: " in segment.ecdaq("xml", "0").stderr
    assert segment.stop("daemon") == 0
