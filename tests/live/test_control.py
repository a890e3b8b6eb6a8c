# SPDX-License-Identifier: MIT
"""Control programs in real time: they run, and when they are in trouble the outputs end safe."""

from __future__ import annotations

import os
import signal
import socket
from collections.abc import Callable
from pathlib import Path
from typing import Any

from segment import BIN, ROOT, Segment, recorded, wait_for

# These measure time, or need a cycle in time.
IDLE = True
BUILD = Path(os.environ.get("ECDAQ_BUILD", ROOT / "build" / "release"))
TROUBLE = BUILD / "tests" / "control" / "trouble.so"
CONTROL_EXIT = 15
OWNED = {
    "slaves[0].name": "a",
    "bus.presence": "any",
    "outputs[0].channel": "a.led",
    "outputs[0].owner": "program",
}


def example(name: str) -> str:
    return str(next(BIN.parent.glob(f"lib*/**/ecdaq/control/{name}.so")))


def terminals(segment: Segment, slave: int = 0) -> dict[str, float]:
    """What the slave has at its terminals, as the simulation knows it."""
    mine, sims = segment.folder / "asking", segment.folder / "control"
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as sock:
        sock.bind(str(mine))
        sock.settimeout(60)
        try:
            sock.sendto(f"io slave={slave}".encode(), str(sims))
            answer = sock.recv(512).decode()
        finally:
            mine.unlink()
    return {key: float(value) for key, value in (w.split("=") for w in answer.split())}


def begin(segment: Segment) -> None:
    segment.start_sim("--control", str(segment.folder / "control"))
    wait_for("control socket", (segment.folder / "control").exists, 60)
    segment.start_daemon()


def start(segment: Segment) -> dict[str, Any]:
    begin(segment)
    return segment.wait_for_op()


def in_trouble(make_segment: Callable[..., Segment], how: str) -> Segment:
    """With a program that switches the LED on and is in trouble in its 3000th cycle."""
    options = {"control.program": str(TROUBLE), "control.options": f"how={how}, after=3000"}
    segment = make_segment(settings=OWNED | options)
    begin(segment)
    segment.start_recorder()
    return segment


def check_led(segment: Segment) -> None:
    """It was on, as the recording shows (three seconds may be too short to look), and goes off."""
    assert segment.stop("recorder") == 0
    assert any(sample.led for sample in recorded(segment.record_dir, "/ecdaq/a"))
    wait_for("LED off", lambda: terminals(segment)["led"] == 0, 60)


def end_of(segment: Segment) -> int:
    return segment.processes.pop("daemon").wait(120)


def test_blink_blinks(make_segment: Callable[..., Segment]) -> None:
    options = {"control.program": example("blink"), "control.options": "slave=a, every=100"}
    segment = make_segment(settings=OWNED | options)
    start(segment)
    for wanted in (1, 0, 1, 0):
        wait_for(f"LED {wanted}", lambda now=wanted: terminals(segment)["led"] == now, 60)
    wait_for("500 calls", lambda: segment.status()["control"]["calls"] >= 500, 60)
    control = segment.wait_for_op()["control"]
    assert control["program"] == "blink" and control["state"] == "running"
    assert control["refused"] == 0
    assert control["time_ns"]["count"] >= 500
    # Nothing may write the output but its owner.
    refused = segment.ecdaq("set", "a.led=1", check=False)
    assert refused.returncode != 0 and "owner" in refused.stderr
    assert segment.stop("daemon") == 0
    wait_for("LED off", lambda: terminals(segment)["led"] == 0, 60)


def test_pi_loop_reaches_its_set_point(make_segment: Callable[..., Segment]) -> None:
    settings = {
        "slaves[0].name": "plant",
        "control.program": example("pi_loop"),
        "control.options": "set=42",
        "outputs[0].channel": "plant.actuator",
        "outputs[0].owner": "program",
    }
    segment = make_segment(slaves="plant", settings=settings)
    start(segment)

    def is_there() -> bool:
        return abs(terminals(segment)["sensor"] - 42) < 0.1

    wait_for("set point", is_there, 120)
    segment.wait_for_cycles(300, 60)
    wait_for("set point still", is_there, 60)
    assert segment.stop("daemon") == 0
    wait_for("actuator off", lambda: terminals(segment)["actuator"] == 0, 60)


def test_after_a_crash_ecdaqd_ends_in_order_and_the_outputs_are_safe(
    make_segment: Callable[..., Segment],
) -> None:
    segment = in_trouble(make_segment, "crash")
    assert end_of(segment) == CONTROL_EXIT
    check_led(segment)
    line = segment.log("daemon").splitlines()
    message = [text for text in line if text.startswith("ecdaqd: control: ")]
    assert len(message) == 1 and "crashed with SIGSEGV (at 0x10) in cycle" in message[0]
    status = segment.status()
    assert status["state"] == "FAILED" and status["exit_code"] == CONTROL_EXIT
    assert status["control"]["state"] == "crashed"
    events = segment.ecdaq("events", "--json").stdout
    assert '"control_crashed"' in events


def test_a_loop_without_end_ends_ecdaqd_and_the_watchdog_makes_the_outputs_safe(
    make_segment: Callable[..., Segment],
) -> None:
    segment = in_trouble(make_segment, "loop")
    assert end_of(segment) == CONTROL_EXIT
    check_led(segment)
    assert "control: trouble: cycle() has not returned for" in segment.log("daemon")
    status = segment.status()
    assert status["state"] == "FAILED" and status["exit_code"] == CONTROL_EXIT
    assert status["control"]["state"] == "stuck"


def test_without_ecdaqd_the_watchdog_makes_the_outputs_safe(
    make_segment: Callable[..., Segment],
) -> None:
    segment = make_segment(
        settings=OWNED | {"control.program": str(TROUBLE), "control.options": "how=none"}
    )
    start(segment)
    wait_for("LED", lambda: terminals(segment)["led"] == 1, 60)
    assert segment.stop("daemon", signal.SIGKILL) == -signal.SIGKILL
    wait_for("LED off", lambda: terminals(segment)["led"] == 0, 60)
