# SPDX-License-Identifier: MIT
"""ecdaq-stream: every cycle and every event is in the stream exactly once, whatever is killed."""

from __future__ import annotations

import json
import os
import random
import subprocess
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
from ecdaq import CONFIG, DISABLED, OK, Fake, ecdaq
from mcap_ros2._dynamic import generate_dynamic
from recording import Bench, wait_until
from stream_bench import SERVER, STREAM, Message, Server, Stream, cycles_of
from stream_keys import Operator, client_context, make_certificates

SLAVES = ("piccolo0", "piccolo1")


@pytest.fixture(autouse=True)
def needed() -> None:
    if not STREAM.exists():
        pytest.skip("ecdaq-stream is not built: it requires libnats-dev and libcjson-dev")
    if SERVER is None:
        pytest.skip("no nats-server here")


@pytest.fixture
def server(tmp_path: Path) -> Iterator[Server]:
    made = Server(tmp_path / "nats")
    made.create_stream()
    yield made
    made.kill()


def session_of(producer: subprocess.Popen[str]) -> int:
    assert producer.stdout is not None
    return int(producer.stdout.readline())


def finish(producer: subprocess.Popen[str]) -> None:
    producer.communicate("", timeout=60)
    assert producer.returncode == 0


def expect_once(messages: list[Message], session: int, cycles: range) -> None:
    """Every cycle of every slave is there, in order, and none twice."""
    for slave in SLAVES:
        found = cycles_of(messages, slave, session)
        missing = len(set(cycles) - set(found))
        doubled = len(found) - len(set(found))
        print(f"{slave}: {len(found)} samples, {missing} missing, {doubled} doubled")
        assert (missing, doubled) == (0, 0)
        assert found == list(cycles)


def events_of(messages: list[Message]) -> list[Message]:
    return [m for m in messages if m.subject == "ecdaq.rig1.event"]


def stored(server: Server) -> int:
    return server.state().messages


def pass_time(seconds: float) -> None:
    """A fault at any place of an exchange: nothing waits for this."""
    end = time.monotonic() + seconds
    wait_until("a random time", lambda: time.monotonic() >= end)


def test_every_cycle_is_stored_once_while_the_server_is_killed_at_random(
    bench: Bench, server: Server
) -> None:
    seed = int(os.environ.get("ECDAQ_SEED", "1"))
    kills = int(os.environ.get("ECDAQ_STREAM_KILLS", "6"))
    chance = random.Random(seed)
    stream = Stream(bench, server.port)
    producer = bench.produce("--cycles", str(3000 * kills), "--pace", "--wait")
    for _ in range(kills):
        before = stored(server)
        wait_until("new blocks", lambda before=before: stored(server) > before)
        pass_time(chance.random())
        server.kill()
        pass_time(chance.random() * 2)
        server.start()
    session = session_of(producer)
    wait_until("all cycles", lambda: server.last_cycle(session) == 3000 * kills)
    finish(producer)
    expect_once(server.messages(), session, range(3000 * kills))
    errors = stream.stop()
    # One line where it fails and one when it is over.
    assert errors.count("sending") <= kills + 1
    assert len(errors.splitlines()) <= 4 * kills, errors


def test_every_cycle_is_stored_once_while_the_streamer_is_killed(
    bench: Bench, server: Server
) -> None:
    stream = Stream(bench, server.port)
    producer = bench.produce("--cycles", "6000", "--pace", "--wait", "--events", "5")
    for _ in range(5):
        before = stored(server)
        wait_until("new blocks", lambda before=before: stored(server) > before)
        stream.kill()
        stream.start()
    session = session_of(producer)
    wait_until("all cycles", lambda: server.last_cycle(session) == 6000)
    finish(producer)
    messages = server.messages()
    expect_once(messages, session, range(6000))
    assert [m.number("Event-Next") for m in events_of(messages)] == [1, 2, 3, 4, 5]
    stream.stop()


def test_what_has_left_the_ring_is_read_from_the_recording(bench: Bench, server: Server) -> None:
    """The ring has two seconds, the server is away for longer."""
    recorder = bench.record()
    stream = Stream(bench, server.port)
    options = ("--pace", "--wait", "--depth", "2048", "--events", "3")
    producer = bench.produce("--cycles", "9000", *options)
    wait_until("first blocks", lambda: stored(server) > 10)
    server.kill()
    session = session_of(producer)  # after the last cycle
    server.start()
    wait_until("all cycles", lambda: server.last_cycle(session) == 9000)
    finish(producer)
    messages = server.messages()
    expect_once(messages, session, range(9000))
    assert len(events_of(messages)) == 3
    stream.stop()
    recorder.terminate()


def test_sessions_that_ended_while_the_streamer_was_away_are_read_from_recordings(
    bench: Bench, server: Server
) -> None:
    recorder = bench.record()
    stream = Stream(bench, server.port)
    sessions = []
    for number in range(3):
        producer = bench.produce("--cycles", "2500", "--wait")
        sessions.append(session_of(producer))
        if number == 0:
            wait_until("all cycles", lambda: server.last_cycle(sessions[0]) == 2500)
            stream.kill()
        finish(producer)
        wait_until("a recording", lambda count=number + 1: len(bench.files()) == count)
    stream.start()
    wait_until("all sessions", lambda: server.last_cycle(sessions[-1]) == 2500)
    messages = server.messages()
    for session in sessions:
        expect_once(messages, session, range(2500))
    documents = [json.loads(m.data) for m in messages if m.subject == "ecdaq.rig1.channels"]
    assert [d["session"] for d in documents] == sessions
    assert [d["topics"] for d in documents] == [documents[0]["topics"]] * 3
    stream.stop()
    recorder.terminate()


def test_a_gap_is_counted_and_sent_as_an_event(bench: Bench, server: Server) -> None:
    stream = Stream(bench, server.port)
    producer = bench.produce("--cycles", "3000", "--wait", "--skip", "1500:100")
    session = session_of(producer)
    wait_until("all cycles", lambda: server.last_cycle(session) == 3000)
    messages = server.messages()
    cycles = cycles_of(messages, "piccolo0", session)
    assert cycles == [*range(1500), *range(1600, 3000)]
    [gap] = events_of(messages)
    assert b"stream_gap" in gap.data
    assert b"stream has a gap: 100 cycles from 1500" in gap.data
    finish(producer)
    stream.stop()


def test_without_recordings_what_left_the_ring_is_a_gap(bench: Bench, server: Server) -> None:
    stream = Stream(bench, server.port)
    producer = bench.produce("--cycles", "6000", "--pace", "--wait", "--depth", "1024")
    wait_until("first blocks", lambda: stored(server) > 6)
    stream.kill()
    session = session_of(producer)
    stream.start()
    wait_until("all cycles", lambda: server.last_cycle(session) == 6000)
    finish(producer)
    messages = server.messages()
    cycles = cycles_of(messages, "piccolo1", session)
    missing = sorted(set(range(6000)) - set(cycles))
    assert missing, "the ring was larger than the outage"
    assert len(cycles) == len(set(cycles))
    [gap] = events_of(messages)
    text = f"stream has a gap: {len(missing)} cycles from {missing[0]}"
    assert text.encode() in gap.data
    stream.stop()


def test_samples_are_those_of_the_recording_and_described_by_the_channel_table(
    bench: Bench, server: Server
) -> None:
    stream = Stream(bench, server.port)
    producer = bench.produce("--cycles", "1000", "--wait")
    session = session_of(producer)
    wait_until("all cycles", lambda: server.last_cycle(session) == 1000)
    finish(producer)
    stream.stop()
    bench.record_all()
    messages = server.messages()
    [document] = [json.loads(m.data) for m in messages if m.subject == "ecdaq.rig1.channels"]
    assert (document["appliance"], document["session"]) == ("rig1", session)
    schemas = bench.schemas()
    for topic in document["topics"]:
        name, _, text = schemas[f"/ecdaq/{topic['topic']}"]
        assert (topic["schema"], topic["ros2msg"]) == (name, text)
    assert [t["topic"] for t in document["topics"]] == list(SLAVES)
    assert document["layout"]["channels"][0]["unit"] in ("", "V")
    for slave in SLAVES:
        recorded = [data for _, data in bench.raw_messages(f"/ecdaq/{slave}")]
        blocks = [m for m in messages if m.subject == f"ecdaq.rig1.{slave}.block"]
        # Behind the stamp, which each program maps from its own view of the clocks.
        assert [d[12:] for b in blocks for d in b.samples()] == [d[12:] for d in recorded]
    topic = document["topics"][0]
    decode = generate_dynamic(topic["schema"], topic["ros2msg"])[topic["schema"]]
    block = next(m for m in messages if m.subject == "ecdaq.rig1.piccolo0.block")
    sine = [decode(data).adc for data in block.samples()]
    assert min(sine) >= 0.49 and max(sine) <= 1.51  # 0.5 V around 1 V, and the step of the ADC
    assert [decode(data).cycle for data in block.samples()] == list(block.cycles())


def test_a_stream_that_is_not_there_is_one_line_with_its_remedy(
    bench: Bench, tmp_path: Path
) -> None:
    server = Server(tmp_path / "nats")
    stream = Stream(bench, server.port)
    connections = server.state_of_server()["total_connections"]
    wait_until(
        "three attempts",
        lambda: server.state_of_server()["total_connections"] >= connections + 3,
    )
    errors = stream.stop()
    server.kill()
    assert errors.splitlines() == [
        f"ecdaq-stream: nats://127.0.0.1:{server.port}: stream ecdaq: not there: "
        "create it, with subject ecdaq.>"
    ]


def test_wrong_credentials_are_one_line(bench: Bench, tmp_path: Path) -> None:
    server = Server(
        tmp_path / "nats", "authorization { token: secret, timeout: 5 }\n", token="secret"
    )
    server.create_stream()
    stream = Stream(bench, server.port)
    log = tmp_path / "nats" / "server.log"
    wait_until("two attempts", lambda: log.read_text().count("authentication error") >= 2)
    [line] = stream.stop().splitlines()
    server.kill()
    assert "Authorization Violation" in line, line


def test_tls_is_required_and_the_server_is_verified(bench: Bench, tmp_path: Path) -> None:
    files = make_certificates(tmp_path)
    server = Server(
        tmp_path / "nats",
        f'tls {{ cert_file: "{files["server.crt"]}", key_file: "{files["server.key"]}", '
        f'ca_file: "{files["ca.crt"]}", verify: true }}\n',
        tls=client_context(files),
    )
    server.create_stream()
    given = {
        "stream_tls": "on",
        "stream_certificate": str(files["client.crt"]),
        "stream_key": str(files["client.key"]),
    }
    stranger = Stream(bench, server.port, **given, stream_ca=str(files["other.crt"]))
    producer = bench.produce("--cycles", "500", "--wait")
    session = session_of(producer)
    log = tmp_path / "nats" / "server.log"
    wait_until("an attempt", lambda: "TLS handshake error" in log.read_text())
    [line] = stranger.stop().splitlines()
    assert "unable to get local issuer certificate" in line, line
    assert stored(server) == 0
    stream = Stream(bench, server.port, **given, stream_ca=str(files["ca.crt"]))
    wait_until("all cycles", lambda: server.last_cycle(session) == 500)
    finish(producer)
    assert stream.stop() == ""
    server.kill()


def test_a_credentials_file_is_used_and_one_that_is_not_there_is_refused(
    bench: Bench, tmp_path: Path
) -> None:
    keys = Operator(tmp_path)
    server = Server(tmp_path / "nats", keys.config, user_credentials=str(keys.credentials))
    server.create_stream()
    producer = bench.produce("--cycles", "500", "--wait")
    session = session_of(producer)
    stream = Stream(bench, server.port, stream_credentials=str(keys.credentials))
    wait_until("all cycles", lambda: server.last_cycle(session) == 500)
    finish(producer)
    assert stream.stop() == ""
    server.kill()
    missing = Stream(bench, server.port, stream_credentials=str(tmp_path / "none.creds"))
    _, errors = missing.process.communicate(timeout=60)
    assert missing.process.returncode == CONFIG, errors
    assert errors.startswith("ecdaq-stream: stream.credentials: "), errors


@pytest.mark.parametrize(
    ("settings", "reason"),
    [
        (("stream.servers=",), "stream.servers: is required while stream.enable is on"),
        (("stream.servers=nats://me:pw@x",), "must be without user and password"),
        (("stream.appliance=a.b",), "stream.appliance: must be letters, digits, - and _"),
        (("stream.stream=>",), "stream.stream: must be letters, digits, - and _"),
        (("stream.key=/k",), "stream.certificate: and stream.key require each other"),
    ],
)
def test_settings_that_cannot_work_are_refused(
    run_dir: Path, settings: tuple[str, ...], reason: str
) -> None:
    words = ["stream.enable=on", "stream.servers=nats://127.0.0.1:1", *settings]
    done = subprocess.run(
        [STREAM, "--run-dir", run_dir, "--check", *(w for x in words for w in ("--set", x))],
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert done.returncode == CONFIG
    assert reason in done.stderr
    assert len(done.stderr.splitlines()) == 1


def test_it_is_off_unless_configured(run_dir: Path) -> None:
    for words, code in (([], OK), (["--check"], DISABLED)):
        done = subprocess.run(
            [STREAM, "--run-dir", run_dir, *words],
            capture_output=True,
            text=True,
            timeout=60,
            check=False,
        )
        assert done.returncode == code
        assert "stream.enable is off" in done.stderr


def test_status_has_a_line_and_an_object_for_the_stream(
    daemon: Fake, server: Server, bench: Bench
) -> None:
    stream = Stream(bench, server.port)
    wait_until("blocks", lambda: stored(server) > 5)

    def line() -> str:
        text = ecdaq(bench.run_dir, "status").stdout
        return next((x for x in text.splitlines() if x.startswith("stream ")), "")

    wait_until("a stream that is live", lambda: line().startswith("stream     live, as rig1 in"))
    assert f"ecdaq at nats://127.0.0.1:{server.port}" in line()
    found = json.loads(ecdaq(bench.run_dir, "status", "--json").stdout)["stream"]
    assert (found["running"], found["appliance"], found["stream"]) == (True, "rig1", "ecdaq")
    assert found["blocks"] > 0
    assert found["gaps"] == 0
    stream.stop()
