# SPDX-License-Identifier: MIT
"""What ecdaq asks of ecdaqd by the admin socket."""

from __future__ import annotations

import json
import re
import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest
from ecdaq import FAILED, NO_DAEMON, OK, REFUSED, USAGE, Fake, fails, json_of, works


def value_of(daemon: Fake, channel: str, cycle: int) -> int | float:
    """In @cycle or in a later one: the newest sample may be older."""
    value: int | float = daemon.sample(cycle, channel)["values"][channel]
    return value


def test_set_prints_the_cycle_of_its_effect(daemon: Fake) -> None:
    before = json_of(daemon("status", "--json"))["cycle_number"]
    answer = json_of(daemon("set", "piccolo0.led=on", "--json"))
    assert answer["cycle"] > before
    assert answer["raw"] == {"piccolo0.led": 1}
    assert value_of(daemon, "piccolo0.led", answer["cycle"]) == 1
    text = works(daemon("set", "piccolo0.led=off"))
    assert text.startswith("piccolo0.led = 0 from cycle ")
    assert value_of(daemon, "piccolo0.led", int(text.split()[-2])) == 0


def test_set_takes_several_outputs_at_once_and_64_bits_exactly(daemon: Fake) -> None:
    big = 2**63 + 1
    answer = json_of(daemon("set", "piccolo0.led=1", f"piccolo1.oneshot_time={big}", "--json"))
    assert answer["raw"] == {"piccolo0.led": 1, "piccolo1.oneshot_time": big}
    assert value_of(daemon, "piccolo1.oneshot_time", answer["cycle"]) == big


@pytest.mark.parametrize(
    ("word", "code", "message"),
    [
        ("piccolo0.led", USAGE, "piccolo0.led: expected OUTPUT=VALUE"),
        ("=1", USAGE, "=1: expected OUTPUT=VALUE"),
        ("piccolo0.led=", USAGE, "expected OUTPUT=VALUE"),
        ("piccolo0.lde=1", FAILED, "piccolo0.lde: no such channel; did you mean piccolo0.led?"),
        ("piccolo0.adc=1", FAILED, "piccolo0.adc: is an input"),
        ("piccolo0.led=2", FAILED, "piccolo0.led: 2 is not a value of type BOOL"),
        ("piccolo0.led=maybe", FAILED, "maybe is not a value of type BOOL"),
        ("piccolo0.oneshot_time=-1", FAILED, "-1 does not fit into UINT64"),
        ("piccolo0.oneshot_time=1.5", FAILED, "1.5 is not a value of type UINT64"),
        ("piccolo1.led=1", REFUSED, "refused: piccolo1.led: owned by program"),
    ],
)
def test_set_refuses_with_a_reason(daemon: Fake, word: str, code: int, message: str) -> None:
    fails(daemon("set", word), code, message)


def test_a_wrong_word_keeps_all_others_from_being_set(daemon: Fake) -> None:
    fails(daemon("set", "piccolo0.led=1", "piccolo0.lde=1"), FAILED)
    assert value_of(daemon, "piccolo0.led", daemon.next_cycle()) == 0


def test_oneshot_arms_all_slaves_for_the_same_instant(daemon: Fake) -> None:
    answer = json_of(daemon("oneshot", "all", "--in", "5s", "--wait", "--json"))
    assert [s["name"] for s in answer["slave"]] == ["piccolo0", "piccolo1"]
    for slave in answer["slave"]:
        assert slave["converted"] is True
        assert slave["sample_time"] == answer["dc_time_ns"]
    assert answer["slave"][1]["adc"] == 2001


def test_oneshot_waits_for_the_value(daemon: Fake) -> None:
    text = works(daemon("oneshot", "piccolo1", "--in", "300ms", "--wait"))
    assert text.startswith("piccolo1: adc 2001, sampled at DC ") and "(+0 ns)" in text


def test_oneshot_takes_an_absolute_time(daemon: Fake) -> None:
    now = json_of(daemon("status", "--json"))["dc_time_ns"]
    at = now + 3600 * 10**9
    text = works(daemon("oneshot", "0", "--at", str(at)))
    assert text.startswith(f"piccolo0: armed for DC {at} from cycle ")


def test_oneshot_in_the_past_is_refused(daemon: Fake) -> None:
    fails(daemon("oneshot", "0", "--at", "5"), REFUSED, "refused: the time is in the past")


def test_oneshot_needs_a_slave_that_is_there(daemon: Fake) -> None:
    fails(daemon("oneshot", "piccolo7", "--in", "1s"), FAILED, "piccolo7: no slave of this name")
    fails(daemon("oneshot", "2", "--in", "1s"), FAILED, "2: no slave at this position")


def test_oneshot_does_not_wait_for_a_bus_that_was_stopped(daemon: Fake) -> None:
    process = daemon.start("oneshot", "all", "--in", "1000s", "--wait", stdout=-1, stderr=-1)
    events = works(daemon("events", "--count", "1"))
    assert events
    daemon.end()
    _, message = process.communicate(timeout=60)
    assert process.returncode in (FAILED, NO_DAEMON)
    assert message.startswith("ecdaq: oneshot: ") and message.count("\n") == 1


@pytest.mark.parametrize(
    ("words", "wanted"),
    [
        (["0", "0x1018:1"], "0x00000002 2\n"),
        (["piccolo1", "0x1018:01", "--type", "UDINT"], "2\n"),
        (["piccolo1", "1018:1", "--type", "dint"], "2\n"),
        (["0", "0x1008", "--type", "STRING"], "FB1111-Piccolo\n"),
        (["0", "0x1008"], "46 42 31 31 31 31 2d 50 69 63 63 6f 6c 6f\n"),
    ],
)
def test_sdo_read_shows_an_object(daemon: Fake, words: list[str], wanted: str) -> None:
    assert works(daemon("sdo", "read", *words)) == wanted


def test_sdo_read_as_json(daemon: Fake) -> None:
    answer = json_of(daemon("sdo", "read", "1", "0x1018:1", "--json"))
    assert answer == {
        "slave": 1,
        "index": 0x1018,
        "subindex": 1,
        "bytes": "02 00 00 00",
        "value": 2,
    }
    text = json_of(daemon("sdo", "read", "1", "0x1008", "--type", "STRING", "--json"))
    assert text["value"] == "FB1111-Piccolo"


def test_sdo_read_shows_the_whole_of_a_long_object(daemon: Fake) -> None:
    image = bytes.fromhex(json_of(daemon("sii", "read", "0", "--json"))["bytes"])
    assert len(image) == 2048
    assert bytes.fromhex(works(daemon("sdo", "read", "0", "0x2000"))) == image
    answer = json_of(daemon("sdo", "read", "0", "0x2000", "--json"))
    assert (bytes.fromhex(answer["bytes"]), answer["value"]) == (image, None)


def test_sdo_write_is_read_back(daemon: Fake) -> None:
    assert works(daemon("sdo", "write", "0", "0x8000:2", "250", "--type", "UINT")) == ""
    assert works(daemon("sdo", "read", "0", "0x8000:2", "--type", "UINT")) == "250\n"


@pytest.mark.parametrize(
    ("words", "code", "message"),
    [
        (["read", "0", "0x1234"], REFUSED, "slave 0 (piccolo0): SDO read: object does"),
        (
            ["write", "0", "0x8000:1", "1", "-t", "USINT"],
            REFUSED,
            "SDO write: data cannot be stored",
        ),
        (["write", "0", "0x8000:2", "1"], USAGE, "write: --type must be one of BOOL|SINT"),
        (["write", "0", "0x8000:2", "65536", "-t", "UINT"], USAGE, "65536: does not fit into UINT"),
        (["write", "0", "0x8000:2", "x", "-t", "UINT"], USAGE, "x: is not a valid UINT"),
        (["write", "0", "0x8000:2", "-1", "-t", "UINT"], USAGE, "-1: does not fit into UINT"),
        (["read", "0", "0x1018:1", "-t", "UINT"], FAILED, "the object has 4 bytes, UINT has 2"),
        (["read", "9", "0x1018:1"], FAILED, "9: no slave at this position, there are 2"),
    ],
)
def test_a_failed_sdo_is_reported_with_its_reason(
    daemon: Fake, words: list[str], code: int, message: str
) -> None:
    fails(daemon("sdo", *words), code, message)


def test_a_dictionary_is_listed_though_answers_are_lost(
    daemon: Fake, fake: Callable[..., Fake]
) -> None:
    wanted = daemon("sdo", "list", "0").stdout
    assert fake("DEAF=1")("sdo", "list", "0").stdout == wanted


def test_start_up_sdos_are_listed_with_where_each_is_from(daemon: Fake) -> None:
    assert works(daemon("sdo", "startup", "0")).splitlines() == [
        "IP  0x8000:01  07  ESI",
        "PS  0x8010:00 complete  01 02 03 04  slaves[].sdo, /etc/ecdaq.yaml:12",
    ]
    first, second = json_of(daemon("sdo", "startup", "0", "--json"))
    assert (first["transition"], first["bytes"], first["origin"]) == ("IP", "07", "ESI")
    assert (first["file"], first["line"], first["complete"]) == (None, None, False)
    assert (second["index"], second["subindex"], second["complete"]) == (0x8010, 0, True)
    assert (second["file"], second["line"]) == ("/etc/ecdaq.yaml", 12)


def test_a_dictionary_with_gaps_is_listed_up_to_an_entry_that_is_refused(daemon: Fake) -> None:
    result = daemon("sdo", "list", "0")
    fails(result, REFUSED, "refused: slave 0 (piccolo0): description: general error")
    assert result.stdout.splitlines() == [
        f"0x6000 record  {'o' * 63}",
        f"  :00    UINT             16  rrrw--  {'e' * 42}",
        f"  :01    UINT             16  rrrw--  {'e' * 42}",
        f"  :03    0x0801           16  rrrw--  {'e' * 42}",
        f"0x7000 record  {'o' * 63}",
    ]
    result = daemon("sdo", "list", "0", "--json")
    fails(result, REFUSED, "general error")
    first, second = (json.loads(line) for line in result.stdout.splitlines())
    assert [entry["subindex"] for entry in first["entry"]] == [0, 1, 3]
    last = first["entry"][2]
    assert (last["name"], last["type"], last["access"]) == ("e" * 63, "0x0801", "rrrw--")
    assert (last["bits"], last["rxpdo"], last["txpdo"]) == (16, False, True)
    assert (first["last"], second["entry"]) == (3, [])


def test_a_dictionary_can_be_listed_in_parts(daemon: Fake) -> None:
    def subindices(*words: str) -> tuple[int, list[int]]:
        found = json_of(daemon("sdo", "list", "0", "0x6000" + words[0], "--json", *words[1:]))
        return found["index"], [entry["subindex"] for entry in found["entry"]]

    assert subindices("") == (0x6000, [0, 1, 3])
    assert subindices(":1", "--count", "2") == (0x6000, [1])  # the second one is a gap
    assert subindices(":2") == (0x6000, [3])
    assert subindices(":3", "--count", "18446744073709551615") == (0x6000, [3])
    assert subindices(":4") == (0x6000, [])
    assert works(daemon("sdo", "list", "0", "--indices")) == "0x6000\n0x7000\n0x8001\n"

    def indices(*words: str) -> tuple[list[int], int]:
        found = json_of(daemon("sdo", "list", "0", "--indices", "--json", *words))
        return found["indices"], found["left"]

    assert indices() == ([0x6000, 0x7000, 0x8001], 0)
    assert indices("--count", "1") == ([0x6000], 2)
    assert indices("0x6001", "--count", "1") == ([0x7000], 1)
    assert indices("0x8002", "--count", "9") == ([], 0)


def test_clear_sets_counters_to_zero(fake: Callable[..., Fake]) -> None:
    """What is counted then are cycles since the command."""
    daemon = fake("SPEED=1")
    before = json_of(daemon("status", "--json"))["cycles"]
    assert json_of(daemon("histogram", "wake", "--json"))["count"] >= before >= 2000
    works(daemon("clear"))
    count = json_of(daemon("histogram", "wake", "--json"))["count"]
    assert count <= json_of(daemon("status", "--json"))["cycles"] - before


def test_stop_waits_until_ecdaqd_is_gone(daemon: Fake) -> None:
    # Its parent, this test, has to take note of its end before it is gone altogether.
    process = daemon.start("stop", "--wait", "20s", stderr=-1)
    assert daemon.process.wait(20) == 0
    _, message = process.communicate(timeout=60)
    assert (process.returncode, message) == (OK, "")
    fails(daemon("stop"), NO_DAEMON, "no answer: is ecdaqd running?")


def test_a_connection_closed_by_ecdaqd_is_named(fake: Callable[..., Fake]) -> None:
    fails(fake("ADMIN=mute")("clear"), NO_DAEMON, "ecdaqd: connection closed without an answer")


def test_an_answer_of_another_version_is_refused(fake: Callable[..., Fake]) -> None:
    fails(fake("ADMIN=garbage")("clear"), FAILED, "the answer is from another version")


def test_a_socket_without_a_server_is_named(fake: Callable[..., Fake], run_dir: Path) -> None:
    daemon = fake("ADMIN=none")
    fails(daemon("clear"), NO_DAEMON, "no answer")
    (run_dir / "admin").write_text("")
    fails(daemon("clear"), NO_DAEMON, "no answer")


def test_state_shows_and_requests(daemon: Fake) -> None:
    shown = json_of(daemon("state", "--json"))
    assert (shown["state"], shown["target"], shown["waiting"]) == ("OP", "OP", False)
    assert [slave["state"] for slave in shown["slave"]] == ["OP", "OP"]
    assert works(daemon("state")).splitlines()[0] == "bus OP, target OP"
    assert works(daemon("state", "preop", "piccolo1")) == ""
    after = json_of(daemon("state", "SAFE-OP", "0", "--json"))
    assert [slave["state"] for slave in after["slave"]] == ["SAFE-OP", "PRE-OP"]
    after = json_of(daemon("state", "init", "--json"))
    assert [slave["state"] for slave in after["slave"]] == ["INIT", "INIT"]
    fails(daemon("state", "BOOT", "piccolo0", "piccolo1"), REFUSED, "refuses BOOT")
    fails(daemon("state", "RUN"), USAGE, "RUN: expected INIT, PREOP, BOOT, SAFEOP or OP")
    fails(daemon("state", "OP", "nobody"), FAILED, "nobody")


def test_state_waits_for_the_target(daemon: Fake) -> None:
    assert works(daemon("state", "--wait", "10s")).splitlines()[0] == "bus OP, target OP"
    fails(daemon("state", "--wait", "10s", "OP"), USAGE, "--wait is for showing")
    works(daemon("stop"))
    late = daemon("state", "--wait", "100ms")
    assert late.returncode == 12
    assert late.stdout.splitlines()[0] == "bus STOPPED, target OP"


def test_rescan_stops_a_bus_in_operation_only_by_force(daemon: Fake) -> None:
    fails(daemon("rescan"), REFUSED, "--force")
    assert works(daemon("rescan", "--force")) == ""
    works(daemon("state", "INIT"))
    after = json_of(daemon("rescan", "--force", "--json"))
    assert after["state"] == "OP"
    assert [slave["state"] for slave in after["slave"]] == ["OP", "OP"]


def test_reg_reads_a_word_or_as_many_bytes_as_asked(daemon: Fake) -> None:
    assert works(daemon("reg", "read", "piccolo0", "0x0130")) == "0x0008 8\n"
    assert works(daemon("reg", "read", "0", "304", "1")) == "0x08 8\n"
    assert works(daemon("reg", "read", "0", "0x130", "3")) == "0x0130  08 00 00\n"
    lines = works(daemon("reg", "read", "0", "0x0000", "0x20")).splitlines()
    assert [line[:6] for line in lines] == ["0x0000", "0x0010"]
    assert json_of(daemon("reg", "read", "0", "0x0130", "--json")) == {
        "slave": 0,
        "register": 0x130,
        "name": "al_status",
        "bytes": "08 00",
        "value": 8,
        "field": [
            {"name": "state", "value": 8, "text": "OP"},
            {"name": "error", "value": 0, "text": ""},
            {"name": "id_loaded", "value": 0, "text": ""},
        ],
    }
    part = json_of(daemon("reg", "read", "0", "0x0130", "1", "--json"))
    assert (part["name"], part["field"]) == (None, [])
    assert json_of(daemon("reg", "read", "0", "0x0130", "3", "--json"))["value"] is None


def test_a_register_is_read_by_name_with_what_its_bits_mean(daemon: Fake) -> None:
    lines = works(daemon("reg", "read", "0", "AL_status")).splitlines()
    assert [" ".join(line.split()) for line in lines] == [
        "0x0008 8", "state 8 OP", "error 0", "id_loaded 0",
    ]  # fmt: skip
    shown = json_of(daemon("reg", "read", "0", "sm2", "--json"))
    assert (shown["name"], shown["register"], shown["value"] is None) == ("sm2", 0x810, False)
    assert [field["name"] for field in shown["field"]][:3] == ["start", "bytes", "mode"]
    for name in ("sm16", "sm", "fmmu-1", "al_statu", "al_status2"):
        fails(daemon("reg", "read", "0", name), USAGE, f"{name}: expected a register")


def test_each_register_that_is_listed_can_be_named(daemon: Fake) -> None:
    listed = json_of(daemon("reg", "list", "--json"))
    assert len(listed) > 50
    for one in listed:
        name = one["name"] + ("0" if one["count"] > 1 else "")
        shown = json_of(daemon("reg", "read", "0", name, "--json"))
        assert (shown["name"], shown["register"]) == (name, one["register"])
        assert len(shown["bytes"].split()) == one["bytes"]
    lines = works(daemon("reg", "list")).splitlines()
    assert "0x0130   2  al_status" in lines and "0x0800   8  smN" in lines


def test_a_watched_register_is_a_line_for_each_change(daemon: Fake) -> None:
    words = ("reg", "watch", "0", "0x0f80", "--interval", "1ms", "--count")
    [line] = works(daemon(*words, "3")).splitlines()
    assert re.fullmatch(r"\S+Z  0x0000 0", line)
    watching = daemon.start(*words, "2000000", stdout=subprocess.PIPE)
    assert watching.stdout is not None
    watching.stdout.readline()
    works(daemon("reg", "write", "0", "0x0f80", "0x1234", "--type", "UINT"))
    assert watching.stdout.readline().endswith("  0x1234 4660\n")
    watching.terminate()
    assert watching.wait(60) == 0
    fails(daemon("reg", "read", "0", "0x0130", "--count", "1"), USAGE, "are options of watch")


@pytest.mark.parametrize("verb", ["read", "watch"])
def test_an_answer_longer_than_the_register_is_not_used(daemon: Fake, verb: str) -> None:
    fails(daemon("reg", verb, "0", "0x0ffe"), FAILED, "512 bytes in answer to 2")


def test_reg_writes_bytes_or_values_of_a_type(daemon: Fake) -> None:
    assert works(daemon("reg", "write", "0", "0x0f80", "1", "0xff", "3")) == ""
    assert works(daemon("reg", "read", "0", "0x0f80", "3")) == "0x0f80  01 ff 03\n"
    assert works(daemon("reg", "write", "0", "0x0f80", "0x1234", "5", "--type", "UINT")) == ""
    assert works(daemon("reg", "read", "0", "0x0f80", "4")) == "0x00051234 332340\n"
    fails(daemon("reg", "write", "0", "0x0120", "2"), REFUSED, "AL control: not written")
    assert works(daemon("reg", "write", "0", "0x0120", "2", "--force")) == ""


@pytest.mark.parametrize(
    ("words", "code", "message"),
    [
        (["peek", "0", "0x0130"], USAGE, "peek: expected read, write, watch or list"),
        (["read", "0", "0x10000"], USAGE, "0x10000: expected a register, 0x0000 to 0xffff"),
        (["read", "0", "AL"], USAGE, "AL: expected a register"),
        (["read", "0", "0x0130", "0"], USAGE, "0: expected a length of 1 to 256 bytes"),
        (["read", "0", "0x0130", "257"], USAGE, "257: expected a length of 1 to 256 bytes"),
        (["read", "0", "0x0130", "1", "2"], USAGE, "read: expected SLAVE REGISTER [LENGTH]"),
        (["read", "0", "0x0130", "--force"], USAGE, "--force: is an option of write"),
        (["write", "0", "0x0130"], USAGE, "write: expected SLAVE REGISTER VALUE..."),
        (["write", "0", "0x0f80", "256"], USAGE, "256: is not a valid USINT (--type for longer"),
        (["write", "0", "0x0f80", "1", "-t", "WORD"], USAGE, "--type: WORD: expected one of"),
        (["read", "piccolo1", "0x0130"], REFUSED, "does not answer"),
        (["read", "nobody", "0x0130"], FAILED, "nobody: no slave of this name"),
    ],
)
def test_a_failed_reg_is_reported_with_its_reason(
    daemon: Fake, words: list[str], code: int, message: str
) -> None:
    fails(daemon("reg", *words), code, message)


def test_sii_goes_to_a_file_and_back(daemon: Fake, tmp_path: Path) -> None:
    image = tmp_path / "piccolo.bin"
    assert works(daemon("sii", "read", "piccolo0", "--output", str(image))) == ""
    data = bytearray(image.read_bytes())
    assert len(data) == 2048
    assert data[1024:1027] == bytes((i * 5 + i // 256) % 256 for i in range(1024, 1027))
    lines = works(daemon("sii", "read", "0")).splitlines()
    assert len(lines) == 128
    assert lines[-1].startswith("0x07f0  ") and lines[-1].endswith(f"{data[-1]:02x}")
    equal = works(daemon("sii", "write", "0", str(image)))
    assert equal == "1024 words, all equal: nothing written\n"
    data[2000] ^= 1
    image.write_bytes(data)
    answer = json_of(daemon("sii", "write", "0", str(image), "--json"))
    assert answer == {"slave": 0, "words": 1024, "written": 1}
    shown = json_of(daemon("sii", "read", "0", "--json"))
    assert bytes.fromhex(shown["bytes"]) == data
    assert (shown["alias"], shown["length"], shown["checksum_ok"]) == (17, 2048, True)
    text = works(daemon("sii", "alias", "0", "0x12"))
    assert text.startswith("8 words, 2 written and verified; in effect after the slave's next")
    assert json_of(daemon("sii", "read", "0", "--json"))["alias"] == 0x12


@pytest.mark.parametrize(
    ("words", "code", "message"),
    [
        (["erase", "0"], USAGE, "erase: expected read, show, write or alias"),
        (["read", "0", "file"], USAGE, "read: expected SLAVE"),
        (["write", "0"], USAGE, "write: expected SLAVE FILE"),
        (["read", "0", "--force"], USAGE, "read: has no option --force"),
        (["show", "0", "--force"], USAGE, "show: has no option --force"),
        (["show", "0", "--output", "x"], USAGE, "show: has no option --output"),
        (["show", "0", "1"], USAGE, "show: expected SLAVE"),
        (["show", "0"], FAILED, "sii: "),
        (["alias", "0", "65536"], USAGE, "65536: expected an alias, 0 to 65535"),
        (["write", "0", "/nowhere/x.bin"], FAILED, "/nowhere/x.bin: No such file"),
        (["write", "0", "/dev/null"], FAILED, "/dev/null: expected 1 to 524288 bytes"),
        (["read", "0", "--output", "/nowhere/x"], FAILED, "/nowhere/x: No such file"),
        (["alias", "piccolo1", "1"], REFUSED, "it is in SAFE-OP or OP"),
    ],
)
def test_a_failed_sii_is_reported_with_its_reason(
    daemon: Fake, words: list[str], code: int, message: str
) -> None:
    fails(daemon("sii", *words), code, message)


def test_crc_shows_the_counters_and_resets_them(daemon: Fake) -> None:
    shown = json_of(daemon("crc", "piccolo0", "--json"))
    assert [slave["name"] for slave in shown] == ["piccolo0"]
    assert [port["receive_errors"] for port in shown[0]["port"]] == [7, 0, 0, 0]
    assert shown[0]["port"][0] == {
        "link": True,
        "open": True,
        "ebus": False,
        "invalid_frames": 11,
        "receive_errors": 7,
        "forwarded_errors": 12,
        "lost_links": 255,
        "cable": "between ecat0 and piccolo0: port 0",
    }
    assert (shown[0]["processing_errors"], shown[0]["pdi_errors"]) == (4, 3)
    assert (shown[0]["watchdog_process_data"], shown[0]["watchdog_pdi"]) == (None, None)
    port = "    0     open   {:14}  {:14}  {:9}  {:10}"
    assert port.format(11, 7, 12, 255) in works(daemon("crc", "0", "--reset")).splitlines()
    lines = works(daemon("crc", "0")).splitlines()
    assert lines[2] == port.format(11, 0, 12, 255)
    assert [line.split()[1] for line in lines[3:6]] == ["-", "link", "-"]
    assert lines[6] == "    processing errors 4, PDI errors 3"
    assert lines[7:] == ["    port 0: check the cable between ecat0 and piccolo0: port 0"]


def test_crc_goes_on_behind_a_slave_that_does_not_answer(daemon: Fake) -> None:
    result = daemon("crc", "1", "0")
    fails(result, REFUSED, "slave 1: no frame came back")
    assert "0 piccolo0" in result.stdout


def test_sixty_four_slaves_with_long_names_fit_80_columns(fake: Callable[..., Fake]) -> None:
    daemon = fake("SLAVES=64", "LONG=1")
    shown = works(daemon("state")).splitlines()
    lines = [line for line in shown if not line.startswith("hint")]  # uncut in a pipe
    assert len(shown) - len(lines) == 2
    assert lines[-2] == f" 63 {'n' * 31} SAFE-OP+ERROR"
    assert lines[-1].startswith("    AL status code 0x002d: ")
    assert len(lines) == 2 + 2 * 64  # with the message
    lines += works(daemon("crc", "0")).splitlines()
    assert "    watchdog expired: process data 8, PDI 9" in lines
    errors = json_of(daemon("crc", "0", "--json"))[0]
    assert (errors["watchdog_process_data"], errors["watchdog_pdi"]) == (8, 9)
    lines += works(daemon("sii", "read", "0")).splitlines()
    lines += works(daemon("reg", "read", "0", "0x0000", "256")).splitlines()
    assert max(len(line) for line in lines) <= 80
    slaves = json_of(daemon("state", "--json"))["slave"]
    assert [slave["position"] for slave in slaves] == list(range(64))
    assert {slave["name"] for slave in slaves} == {"n" * 31}
