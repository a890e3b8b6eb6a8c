# SPDX-License-Identifier: MIT
"""The tree of ports, and the cables that ecdaq names by it."""

from __future__ import annotations

import re
from collections.abc import Callable

from ecdaq import FAILED, REFUSED, USAGE, Fake, fails, json_lines, json_of, works


def test_the_tree_shows_branches_states_and_delays(fake: Callable[..., Fake]) -> None:
    lines = works(fake("BRANCHES=1")("topology")).splitlines()
    assert lines[0].split() == ["pos", "slave", "state", "port", "at", "cable", "clock"]
    assert [line[4:14].rstrip() for line in lines[1:]] == [
        "piccolo0",
        "+-piccolo1",
        "| piccolo2",
        "piccolo3",
        "piccolo4",
    ]
    assert lines[1].split() == ["0", "piccolo0", "OP", "0", "master", "reference"]
    assert lines[2].split() == ["1", "+-piccolo1", "OP", "0", "0:3", "310", "ns", "310", "ns"]
    assert lines[4].split()[2:5] == ["unknown", "0", "0:1"]
    assert not any(line.endswith(" ") for line in lines)


def test_a_named_slave_is_shown_with_what_is_behind_it(fake: Callable[..., Fake]) -> None:
    daemon = fake("BRANCHES=1")
    for words, names in (
        (["piccolo1"], ["piccolo1", "piccolo2"]),
        (["3"], ["piccolo3", "piccolo4"]),
        (["4", "2"], ["piccolo2", "piccolo4"]),
        (["alias:1001"], ["piccolo1", "piccolo2"]),
    ):
        found = json_of(daemon("topology", "--json", *words))
        assert [slave["name"] for slave in found] == names
    fails(daemon("topology", "nobody"), FAILED, "nobody: no slave of this name")
    fails(daemon("topology", "5"), FAILED, "5: no slave at this position, there are 5")


def test_the_tree_as_json(fake: Callable[..., Fake]) -> None:
    found = json_of(fake("BRANCHES=1")("topology", "--json"))
    places = [(s["parent"], s["parent_port"], s["port"], s["open_ports"]) for s in found]
    assert places == [
        (None, None, 0, [0, 1, 3]),
        (0, 3, 0, [0, 1]),
        (1, 1, 0, [0]),
        (0, 1, 0, [0, 1]),
        (3, 1, 0, [0]),
    ]
    assert [slave["cable_ns"] for slave in found] == [None, 310, 310, 310, 310]
    assert found[1]["receive_errors"] == [3, 0, 0, 0]
    assert found[1]["lost_links"] == [0, 255, 0, 0]
    assert (found[0]["dc_reference"], found[1]["clock_delay_ns"]) == (True, 310)


def test_the_graph_has_each_slave_each_cable_and_its_errors(fake: Callable[..., Fake]) -> None:
    text = works(fake("BRANCHES=1")("topology", "--dot"))
    assert text.startswith("digraph ecdaq {\n") and text.endswith("}\n")
    assert text.isascii()  # the devices of this segment are not
    assert len(re.findall(r"^  s\d+ \[label=", text, re.M)) == 5
    edges = re.findall(r"^  (\w+) -> (s\d+) \[(.*)\];$", text, re.M)
    assert [edge[:2] for edge in edges] == [
        ("master", "s0"),
        ("s0", "s1"),
        ("s1", "s2"),
        ("s0", "s3"),
        ("s3", "s4"),
    ]
    assert edges[0][2] == 'headlabel="0" label=""'
    assert 'taillabel="3" headlabel="0" label="310 ns\\n3 errors, 0 lost' in edges[1][2]
    assert "0 errors, 255 lost links" in edges[2][2]  # of the slave before
    assert edges[3][2] == 'taillabel="1" headlabel="0" label="310 ns"'
    assert text.count("color=red") == 2 + 3  # cables with errors, slaves that are not in OP


def test_the_tree_of_64_slaves_with_long_names_fits_80_columns(fake: Callable[..., Fake]) -> None:
    lines = works(fake("SLAVES=64", "LONG=1")("topology")).splitlines()
    assert len(lines) == 1 + 64
    assert max(len(line) for line in lines) <= 80


def test_the_tree_is_shown_after_the_end_of_ecdaqd(daemon: Fake) -> None:
    before = works(daemon("topology"))
    daemon.end()
    assert works(daemon("topology")) == before


def test_an_alias_selects_a_slave_in_every_verb(daemon: Fake) -> None:
    assert [s["name"] for s in json_of(daemon("topology", "alias:1001", "--json"))] == ["piccolo1"]
    fails(daemon("reg", "read", "alias:1001", "0x130"), REFUSED, "slave 1")
    fails(daemon("reg", "read", "alias:5", "0x130"), FAILED, "alias:5: no slave has this alias")
    for alias in ("alias:", "alias:0", "alias:65536", "alias:x", "alias:-1"):
        fails(daemon("crc", alias), FAILED, f"{alias}: expected an alias, 1 to 65535")


def test_an_alias_of_several_slaves_is_refused(fake: Callable[..., Fake]) -> None:
    daemon = fake("ALIAS=9")
    fails(daemon("crc", "alias:9"), FAILED, "alias:9: 2 slaves have this alias")


def test_crc_names_the_cable_of_a_port_with_errors(fake: Callable[..., Fake]) -> None:
    daemon = fake("BRANCHES=1")
    lines = works(daemon("crc", "0")).splitlines()
    assert lines[-1] == "    port 0: check the cable between ecat0 and piccolo0: port 0"
    ports = json_of(daemon("crc", "0", "--json"))[0]["port"]
    assert [port["cable"] for port in ports] == [
        "between ecat0 and piccolo0: port 0",
        "between piccolo0: port 1 and piccolo3: port 0",
        "at piccolo0: port 2",
        "between piccolo0: port 3 and piccolo1: port 0",
    ]


def test_crc_names_the_ebus_of_modules_that_have_no_cable(fake: Callable[..., Fake]) -> None:
    daemon = fake("EBUS=1", "LONG=1", "NOISY=1")
    name = "n" * 31
    lines = works(daemon("crc", "0")).splitlines()
    assert lines[-4].startswith("    port 0: check the cable between ecat0")
    assert lines[-2:] == [
        f"    port 1: check the E-bus between {name}: port 1",
        f"            and {name}: port 0",
    ]
    assert max(len(line) for line in lines) <= 80
    ports = json_of(daemon("crc", "0", "--json"))[0]["port"]
    assert [port["ebus"] for port in ports] == [False, True, False, False]
    again = works(fake("EBUS=1", "NOISY=1")("crc", "0", "-i", "1ms", "-n", "2"))
    assert again.splitlines()[-1].startswith("    port 1: check the E-bus between ")


def test_the_cable_of_slaves_with_long_names_fits_80_columns(fake: Callable[..., Fake]) -> None:
    lines = works(fake("LONG=1", "NOISY=1")("crc", "0")).splitlines()
    name = "n" * 31
    assert lines[-2:] == [
        f"    port 1: check the cable between {name}: port 1",
        f"            and {name}: port 0",
    ]
    assert max(len(line) for line in lines) <= 80


def test_crc_again_and_again_shows_what_was_added(fake: Callable[..., Fake]) -> None:
    daemon = fake("NOISY=1")
    words = ["crc", "0", "--interval", "1ms", "--count", "3"]
    first, *others = [line[0] for line in json_lines(daemon(*words, "--json"))]
    assert "added" not in first["port"][0]
    assert len(others) == 2
    for shown in others:
        assert shown["port"][1]["added"] == {
            "invalid_frames": 0,
            "receive_errors": 2,
            "forwarded_errors": 0,
            "lost_links": 0,
        }
        assert set(shown["port"][0]["added"].values()) == {0}
    text = works(daemon(*words))
    assert text.count("    port  state ") == 1
    assert text.count("  0 piccolo0: port 1: +0 invalid frames, +2 receive errors,") == 2
    assert text.count("    +0 forwarded, +0 lost links\n") == 2
    assert text.count("check the cable between piccolo0: port 1 and piccolo1: port 0") == 3


def test_a_counter_that_was_set_to_zero_meanwhile_counts_from_there(
    fake: Callable[..., Fake],
) -> None:
    daemon = fake("NOISY=1")
    for _ in range(100):
        works(daemon("crc", "0"))  # up to 250, then from 2 on
    found = json_lines(daemon("crc", "0", "-i", "1ms", "-n", "60", "--json"))
    counts = [line[0]["port"][1]["receive_errors"] for line in found]
    assert min(counts) == 2 and max(counts) == 250
    assert {line[0]["port"][1]["added"]["receive_errors"] for line in found[1:]} == {2}


def test_mistakes(daemon: Fake) -> None:
    fails(daemon("topology", "--dot", "--json"), USAGE, "--dot and --json exclude each other")
    fails(daemon("crc", "--interval", "0"), USAGE, "--interval")
    fails(daemon("crc", "--count", "0"), USAGE, "--count")
