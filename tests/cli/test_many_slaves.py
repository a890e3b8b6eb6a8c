# SPDX-License-Identifier: MIT
"""512 slaves with 3072 channels: everything that reads shows each of them, and the right values."""

from __future__ import annotations

import json
import math
import signal
import subprocess
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from ecdaq import BIN, BUILD, USAGE, Fake, fails, json_lines, json_of, wait_until, works
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory

SLAVES = 512
LAST = SLAVES - 1
ENTRIES = ("led", "oneshot_time", "adc", "counter", "sample_time", "status")
NAMES = [f"piccolo{i}" for i in range(SLAVES)]
ITEMS = 64  # ADMIN_ITEMS


@pytest.fixture(scope="module")
def daemon(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Fake]:
    program = BUILD / "tests" / "cli" / "test_fake_daemon_512"
    fake = Fake(tmp_path_factory.mktemp("run512"), program=program)
    yield fake
    fake.close()


def test_every_slave_is_shown_with_its_own_place(daemon: Fake) -> None:
    found = json_of(daemon("slaves", "--json"))
    assert [(s["position"], s["name"], s["station_address"]) for s in found] == [
        (i, NAMES[i], 0x1001 + i) for i in range(SLAVES)
    ]
    assert [line.split()[:2] for line in works(daemon("slaves")).splitlines()[-2:]] == [
        [str(i), f"0:{i}"] for i in (LAST - 1, LAST)
    ]


def test_state_and_status_have_every_slave(daemon: Fake) -> None:
    state = json_of(daemon("state", "--json"))["slave"]
    assert [(s["position"], s["name"], s["state"]) for s in state] == [
        (i, name, "OP") for i, name in enumerate(NAMES)
    ]
    assert works(daemon("state")).splitlines()[-1].split() == [str(LAST), NAMES[LAST], "OP"]

    def all_have_samples() -> bool:
        slaves = json_of(daemon("status", "--json"))["slave"]
        assert [s["name"] for s in slaves] == NAMES
        return all(s["good"] > 0 for s in slaves)

    wait_until(all_have_samples)
    rows = [line.split() for line in works(daemon("status")).splitlines()[-SLAVES:]]
    assert [row[:3] for row in rows] == [[str(i), name, "OP"] for i, name in enumerate(NAMES)]


def test_every_channel_is_shown(daemon: Fake) -> None:
    found = json_of(daemon("channels", "--json"))
    assert [c["name"] for c in found] == [f"{name}.{e}" for name in NAMES for e in ENTRIES]
    assert len({(c["bit_offset"], c["bit_length"]) for c in found}) == len(found)
    assert {c["slave"] for c in found} == set(range(SLAVES))
    assert len(works(daemon("channels")).splitlines()) == 1 + len(found)


def test_samples_of_the_last_slave_are_its_own(daemon: Fake) -> None:
    first, last, third = (f"piccolo{i}.sample_time" for i in (0, LAST, LAST - 2))
    adc = f"piccolo{LAST}.adc"
    lines = json_lines(daemon("watch", "--json", "--count", "80", first, last, third, adc))
    assert len(lines) == 80
    for line in lines:
        values = line["values"]
        if "lost" in line["flags"]:
            assert sorted(line["bad"]) == sorted(values)
            continue
        assert line["bad"] == []
        assert values[first] == values[last] == values[third] == line["dc_time_ns"]
        volt = 1 + 0.5 * math.sin(2 * math.pi * (line["cycle"] % 1000 / 1000 - 0.25 * LAST))
        assert abs(values[adc] * 3.3 / 4096 - volt) < 0.001
    assert any("lost" in line["flags"] for line in lines)


def test_as_many_outputs_as_a_request_has_are_set_at_once_and_no_more(daemon: Fake) -> None:
    words = [f"{name}.led=1" for name in NAMES if name != "piccolo1"]
    done = json_of(daemon("set", "--json", *words[-ITEMS:]))
    assert done["raw"] == {word.split("=")[0]: 1 for word in words[-ITEMS:]}
    fails(
        daemon("set", *words[: ITEMS + 1]),
        USAGE,
        "65 outputs: one command sets up to 64, all in the same cycle; "
        "use several commands, each takes effect in a cycle of its own",
    )
    # None of them was sent.
    shown = daemon.sample(daemon.next_cycle(), "piccolo0.led", "piccolo511.led")
    assert shown["values"] == {"piccolo0.led": 0, "piccolo511.led": 1}


def record(folder: Path, cycles: int, bad_every: int) -> Path:
    run_dir, record_dir = folder / "run", folder / "record"
    run_dir.mkdir()
    producer = BUILD / "tests" / "cli" / "test_ring_producer_512"
    options = ["--cycles", str(cycles), "--bad", str(bad_every), "--depth", "1024"]
    subprocess.run([producer, run_dir, *options], check=True, capture_output=True)
    command = [str(BIN / "ecdaq-record"), "--run-dir", str(run_dir)]
    recorder = subprocess.Popen([*command, "--set", f"record.dir={record_dir}"])
    wait_until(lambda: list(record_dir.glob("*.mcap")) != [], 60)
    recorder.send_signal(signal.SIGTERM)
    assert recorder.wait(60) == 0
    return record_dir


def messages(record_dir: Path, *topics: str) -> Iterator[tuple[str, Any]]:
    for path in sorted(record_dir.glob("*.mcap")):
        with path.open("rb") as file:
            reader = make_reader(file, decoder_factories=[DecoderFactory()])
            for _, channel, _, message in reader.iter_decoded_messages(topics=list(topics)):
                yield channel.topic, message


def test_a_recording_holds_every_cycle_of_every_slave(tmp_path: Path) -> None:
    cycles, bad_every = 120, 7
    record_dir = record(tmp_path, cycles, bad_every)
    bits = [m.slaves_bad for _, m in messages(record_dir, "/ecdaq/cycle")]
    for number, octets in enumerate(bits):
        bad = {8 * i + n for i, octet in enumerate(octets) for n in range(8) if octet >> n & 1}
        assert (len(octets), bad) == (SLAVES // 8, {LAST} if number % bad_every == 0 else set())
    assert len(bits) == cycles

    wanted = {f"/ecdaq/{NAMES[i]}": i for i in (0, 63, 64, 255, LAST)}
    count = dict.fromkeys(wanted, 0)
    for topic, m in messages(record_dir, *wanted):
        slave, number = wanted[topic], count[topic]
        volt = 1 + 0.5 * math.sin(2 * math.pi * (number % 1000 / 1000 - 0.25 * slave))
        assert (m.cycle, m.counter, m.sample_time) == (number, number, m.dc_time_ns)
        assert m.good == (slave != LAST or number % bad_every != 0)
        assert abs(m.adc_raw * 3.3 / 4096 - volt) < 0.001
        assert m.adc == pytest.approx(m.adc_raw * 3.3 / 4096) if m.good else math.isnan(m.adc)
        count[topic] += 1
    assert set(count.values()) == {cycles}
    check = subprocess.run(
        [BIN / "ecdaq", "log", "check", "--json", record_dir], capture_output=True, check=True
    )
    assert json.loads(check.stdout)["cycles"] == cycles
    with next(iter(record_dir.glob("*.mcap"))).open("rb") as file:
        summary = make_reader(file).get_summary()
    assert summary is not None
    topics = {c.topic for c in summary.channels.values()}
    assert {f"/ecdaq/{name}" for name in NAMES} <= topics
