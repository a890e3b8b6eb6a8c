# SPDX-License-Identifier: MIT
"""ecdaq-web: what it serves to viewers, and what it does to hostile and slow ones."""

from __future__ import annotations

import json
import os
import re
import shutil
import socket
import struct
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

import npm
import pytest
from ecdaq import BUILD
from recording import Bench, wait_until
from web_bench import WEB, Web
from web_client import RejectedError, Viewer, WebSocket, http

VIEWER = Path(__file__).with_name("foxglove_viewer")
CYCLE, SLAVE = "/ecdaq/cycle", "/ecdaq/piccolo0"
# The stamp of a slave's message, after the CDR head: seconds, nanoseconds.
STAMP = slice(4, 12)
SECONDS = 60
MANY = BUILD / "tests" / "cli" / "test_ring_producer_512"


def cycle_of(data: bytes) -> int:
    return struct.unpack_from("<Q", data, 4)[0]


def messages(viewer: Viewer, topic: str, count: int) -> list[tuple[int, bytes]]:
    """The next @count messages of @topic: time and data."""
    got: list[tuple[int, bytes]] = []
    while len(got) < count:
        message = viewer.step()
        if message and message[0] == topic:
            got.append(message[1:])
    return got


def test_a_viewer_gets_every_cycle_from_its_subscription_on(bench: Bench, web: Web) -> None:
    bench.produce("--cycles", "1000000", "--pace")
    viewer = Viewer(web.port)
    viewer.wait_for_topics(CYCLE, SLAVE)
    viewer.subscribe(CYCLE)
    cycles = [cycle_of(data) for _, data in messages(viewer, CYCLE, 2000)]
    assert cycles == list(range(cycles[0], cycles[0] + 2000))
    assert viewer.statuses == []


def test_channels_have_the_schemas_of_a_recording(bench: Bench, web: Web) -> None:
    producer = bench.produce("--cycles", "200", "--wait")
    viewer = Viewer(web.port)
    viewer.wait_for_topics(CYCLE, SLAVE, "/ecdaq/piccolo1")
    producer.communicate("", timeout=SECONDS)
    bench.record_all()
    recorded = bench.schemas()
    assert {t: c["schemaName"] for t, c in viewer.channels.items()} == {
        t: name for t, (name, _, _) in recorded.items()
    }
    for topic, (_, encoding, text) in recorded.items():
        channel = viewer.channels[topic]
        assert (channel["encoding"], channel["schemaEncoding"]) == ("cdr", encoding)
        assert channel["schema"] == text


def run_foreign_viewer(port: int, count: int, tmp_path: Path) -> list[dict[str, Any]]:
    """What the published client receives; it is installed once and kept."""
    folder = npm.install(VIEWER, "@foxglove/ws-protocol")
    shutil.copy(VIEWER / "viewer.js", folder)
    out = tmp_path / "viewer.jsonl"
    with out.open("wb") as file:
        done = subprocess.run(
            ["node", "viewer.js", f"ws://127.0.0.1:{port}", str(count), CYCLE, SLAVE],
            cwd=folder, stdout=file, stderr=subprocess.PIPE, text=True, timeout=120, check=False,
        )  # fmt: skip
    assert done.returncode == 0, done.stderr
    return [json.loads(line) for line in out.read_text().splitlines()]


def test_the_published_client_sees_what_is_recorded_without_a_gap(
    bench: Bench, web: Web, tmp_path: Path
) -> None:
    """10 s at 1 kHz."""
    bench.produce("--cycles", "1000000", "--pace")
    recorder = bench.record()
    wait_until("a recording", lambda: bench.recorded_bytes() > 0)
    lines = run_foreign_viewer(web.port, 10000, tmp_path)
    recorder.terminate()
    recorder.communicate(timeout=SECONDS)
    for topic, at in ((CYCLE, slice(0, 0)), (SLAVE, STAMP)):
        seen = [
            (int(m["time"]), bytes.fromhex(m["data"])) for m in lines if m.get("topic") == topic
        ]
        cycles = [number_of(topic, data) for _, data in seen]
        assert cycles == list(range(cycles[0], cycles[0] + len(cycles)))
        assert len(cycles) >= 9990
        recorded = {number_of(topic, d): (t, d) for t, d in bench.raw_messages(topic)}
        for number, (stamp, data) in zip(cycles, seen, strict=True):
            recorded_stamp, recorded_data = recorded[number]
            assert without(data, at) == without(recorded_data, at)
            # Each program fits its own map of DC time to UTC.
            assert abs(stamp - recorded_stamp) < 1_000_000


def test_the_published_client_reads_parameters_and_sets_none(bench: Bench, web: Web) -> None:
    bench.produce("--cycles", "1000000", "--pace", "--session", "18446744073709551615")
    folder = npm.install(VIEWER, "@foxglove/ws-protocol")
    shutil.copy(VIEWER / "parameters.js", folder)
    names = ["piccolo1.adc.unit", "ecdaq.period_ns", "no.such", "ecdaq.session"]
    done = subprocess.run(
        ["node", "parameters.js", f"ws://127.0.0.1:{web.port}", *names],
        cwd=folder, capture_output=True, text=True, timeout=60, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    assert found["capabilities"] == ["parameters"]
    assert {p["name"]: p["value"] for p in found["some"]} == {
        "piccolo1.adc.unit": "V",
        "ecdaq.period_ns": 1_000_000,
        "ecdaq.session": "18446744073709551615",
    }
    everything = {p["name"]: p["value"] for p in found["all"]}
    assert len(everything) == len(found["all"])
    assert everything["ecdaq.appliance"] == socket.gethostname()
    assert re.fullmatch(r"\d+\.\d+\.\d+.*", everything["ecdaq.version"])
    assert everything["piccolo0.adc.slave"] == "piccolo0"
    assert everything["piccolo0.adc.direction"] == "input"
    assert 0 < everything["piccolo0.adc.scale"] < 1
    assert everything["piccolo0.adc.offset"] == pytest.approx(0)
    assert (found["status"]["level"], found["status"]["message"]) == (
        2,
        "parameters were not set: they can only be read",
    )


def test_parameters_are_answered_some_times_a_second(bench: Bench, web: Web) -> None:
    bench.produce("--cycles", "1000000", "--pace")
    viewer = Viewer(web.port)
    viewer.wait_for_topics(SLAVE)
    for _ in range(50):
        viewer.send('{"op":"getParameters","parameterNames":[]}')
    while not viewer.statuses:
        viewer.step()
    assert viewer.statuses[0]["message"] == "too many requests for parameters in a second"


def number_of(topic: str, data: bytes) -> int:
    """The cycle of a message; a slave's begins with a header: stamp, empty frame id."""
    return cycle_of(data) if topic == CYCLE else struct.unpack_from("<Q", data, 4 + 16)[0]


def without(data: bytes, part: slice) -> bytes:
    return data[: part.start] + data[part.stop :]


def test_a_new_session_has_new_channels_and_the_viewer_is_told(bench: Bench, web: Web) -> None:
    first = bench.produce("--cycles", "100", "--wait")
    viewer = Viewer(web.port)
    viewer.wait_for_topics(SLAVE)
    old = viewer.channels[SLAVE]["id"]
    first.communicate("", timeout=SECONDS)
    bench.produce("--cycles", "1000000", "--pace")
    while viewer.channels.get(SLAVE, {"id": old})["id"] == old:
        viewer.step()
    viewer.subscribe(SLAVE)
    assert len(messages(viewer, SLAVE, 10)) == 10
    viewer.ask(op="subscribe", subscriptions=[{"id": 900, "channelId": old}])
    while not viewer.statuses:
        viewer.step()
    assert "there is no such channel" in viewer.statuses[0]["message"]


def test_a_viewer_may_come_before_the_master(bench: Bench, web: Web) -> None:
    viewer = Viewer(web.port)
    viewer.wait_for_topics(CYCLE)
    assert SLAVE not in viewer.channels
    bench.produce("--cycles", "100", "--wait")
    viewer.wait_for_topics(SLAVE)


def test_a_slow_viewer_loses_counted_messages_and_no_other_viewer_does(
    bench: Bench, make_web: Callable[..., Web]
) -> None:
    """It reads nothing for longer than the outbox lasts; what another one reads is complete."""
    web = make_web()
    bench.start(MANY, bench.run_dir, "--cycles", "1000000", "--pace")
    topics = [CYCLE, *(f"/ecdaq/piccolo{n}" for n in range(30))]
    slow = Viewer(web.port, receive_bytes=4096)
    slow.wait_for_topics(*topics)
    slow.subscribe(*topics)
    [(_, data)] = messages(slow, CYCLE, 1)
    first = cycle_of(data)
    fast = Viewer(web.port)
    fast.wait_for_topics(CYCLE)
    fast.subscribe(CYCLE)
    messages(fast, CYCLE, 1)
    resident = web.resident_bytes()
    cycles = [cycle_of(d) for _, d in messages(fast, CYCLE, 8000)]
    assert cycles == list(range(cycles[0], cycles[0] + 8000))
    assert fast.statuses == []
    # The outbox is of fixed size, 8 MiB.
    assert web.resident_bytes() < resident + 12 * 1024 * 1024
    seen, last = 1, first
    while last == first + seen - 1:
        [(_, data)] = messages(slow, CYCLE, 1)
        last = cycle_of(data)
        seen += 1
    missing = last - first + 1 - seen
    while len(slow.statuses) < 2:
        slow.step()
    assert "messages were dropped" in slow.statuses[0]["message"]
    # Those of the cycle topic, and of 30 others.
    assert int(slow.statuses[1]["message"].split(", ")[1].split()[0]) > 20 * missing > 2000
    slow.close()
    fast.close()
    assert "a client was slower than the data" in web.stop()


def test_only_the_page_is_served_and_only_by_get(web: Web) -> None:
    status, headers, body = http(web.port, "GET /")
    assert (status, headers["content-type"]) == (200, "text/html; charset=utf-8")
    assert b"ecdaq" in body
    assert "default-src 'none'" in headers["content-security-policy"]
    assert "unsafe" not in headers["content-security-policy"]
    assert headers["x-content-type-options"] == "nosniff"
    assert http(web.port, "HEAD /")[::2] == (200, b"")
    for path in ("/../etc/passwd", "/%2e%2e/etc/passwd", "//etc/passwd", "/nothing"):
        assert http(web.port, f"GET {path}")[0] in (403, 404)
    assert http(web.port, "POST /")[0] == 405
    assert http(web.port, "DELETE /")[0] in (403, 404, 405)


def test_a_name_that_is_not_ours_is_rejected(make_web: Callable[..., Web]) -> None:
    """DNS rebinding."""
    web = make_web(web_hosts="plant.example")
    assert http(web.port, "GET /", Host="plant.example")[0] == 200
    assert http(web.port, "GET /", Host="evil.example")[0] == 403
    with pytest.raises(RejectedError, match="403"):
        WebSocket(web.port, Host="evil.example")
    assert 'host "evil.example": add the name to web.hosts' in web.stop()


def test_a_page_of_another_site_gets_no_connection(make_web: Callable[..., Web]) -> None:
    web = make_web(web_origins="https://app.foxglove.dev")
    WebSocket(web.port, Origin=f"http://127.0.0.1:{web.port}").close()
    WebSocket(web.port, Origin="https://app.foxglove.dev").close()
    for origin in ("https://evil.example", "null", "x" * 1000):
        with pytest.raises(RejectedError, match="403"):
            WebSocket(web.port, Origin=origin)
    assert "web.origins" in web.stop()


def test_a_websocket_without_a_protocol_of_ours_is_rejected(web: Web) -> None:
    for protocols in ((), ("other.v1",), ("http",)):
        with pytest.raises(RejectedError):
            WebSocket(web.port, protocols)


def test_one_client_more_than_the_limit_is_rejected(make_web: Callable[..., Web]) -> None:
    web = make_web(web_clients="2")
    kept = [WebSocket(web.port), WebSocket(web.port)]
    with pytest.raises(RejectedError, match="503"):
        WebSocket(web.port)
    kept.pop().close()
    wait_until("a free place", lambda: connects(web.port))


def connects(port: int) -> bool:
    try:
        WebSocket(port).close()
    except RejectedError:
        return False
    return True


@pytest.mark.parametrize(
    "request_text",
    [
        "{",
        "[]",
        '{"op":"subscribe"}',
        '{"op":"subscribe","subscriptions":[{"id":1,"channelId":77}]}',
        '{"op":"unsubscribe","subscriptionIds":[5]}',
        '{"op":"advertise","channels":[]}',
        '{"op":"getParameters"}',
        '{"op":"getParameters","parameterNames":[1]}',
        '{"op":"setParameters","parameters":[]}',
        json.dumps({"op": "getParameters", "parameterNames": ["x"] * 1025}),
        "[" * 5000,
    ],
)
def test_a_wrong_request_is_answered_with_its_reason(web: Web, request_text: str) -> None:
    viewer = Viewer(web.port)
    viewer.send(request_text)
    while not viewer.statuses:
        viewer.step()
    assert viewer.statuses[0]["level"] in (1, 2)
    viewer.wait_for_topics(CYCLE)


def test_a_request_that_is_too_long_or_a_flood_ends_the_connection(web: Web) -> None:
    for text, count in (("x" * 70000, 1), ("x" * 60000, 20)):
        client = WebSocket(web.port)
        with pytest.raises((ConnectionError, BrokenPipeError)):
            for _ in range(count):
                client.send(text)
            while True:
                client.recv()
    WebSocket(web.port).close()


def test_connections_that_send_nothing_do_not_keep_others_out(web: Web) -> None:
    silent = [socket.create_connection(("127.0.0.1", web.port)) for _ in range(100)]
    wait_until("an answer", lambda: answers(web.port), 40)
    for sock in silent:
        sock.close()


def answers(port: int) -> bool:
    try:
        return http(port, "GET /")[0] == 200
    except OSError:
        return False
    except (IndexError, ValueError):
        return False


def test_a_port_in_use_and_a_wrong_address_have_their_reason(bench: Bench, web: Web) -> None:
    def run(*settings: str) -> tuple[int, str]:
        words = [w for s in ("web.enable=on", *settings) for w in ("--set", s)]
        got = subprocess.run(
            [WEB, "--run-dir", bench.run_dir, *words],
            capture_output=True, text=True, timeout=SECONDS, check=False,
        )  # fmt: skip
        return got.returncode, got.stderr

    code, errors = run(f"web.port={web.port}")
    assert code != 0
    assert f"cannot listen on loopback port {web.port} (web.listen, web.port): Address" in errors
    code, errors = run("web.listen=192.0.2.1")
    assert (code != 0, "192.0.2.1" in errors) == (True, True)
    code, errors = run("web.listen=nowhere")
    assert (code, "web.listen" in errors) == (3, True)


def test_it_is_off_unless_it_is_enabled(bench: Bench, web: Web) -> None:
    got = subprocess.run(
        [WEB, "--run-dir", bench.run_dir],
        capture_output=True, text=True, timeout=SECONDS, check=False,
    )  # fmt: skip
    assert (got.returncode, "web.enable" in got.stdout + got.stderr) == (0, True)


def test_nobody_there_costs_next_to_nothing(bench: Bench, web: Web) -> None:
    bench.produce("--cycles", "1000000", "--pace")
    viewer = Viewer(web.port)
    viewer.wait_for_topics(SLAVE)
    viewer.close()
    probe = Viewer(web.port)
    probe.wait_for_topics(CYCLE)
    probe.subscribe("/ecdaq/timemap")
    before = web.cpu_seconds()
    messages(probe, "/ecdaq/timemap", 5)
    # Of about five; the sanitizers take their own.
    limit = 1 if os.environ.get("ECDAQ_FLAVOUR", "release") == "release" else 4
    assert web.cpu_seconds() - before < limit
