# SPDX-License-Identifier: MIT
"""The loopback example as its documentation starts it: coupler, configuration, program."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable

from segment import BIN, ROOT, Segment, recorded, wait_for

# These measure time, or need a cycle in time.
IDLE = True
CONFIG = ROOT / "app" / "examples" / "loopback" / "ecdaq.yaml"
SEND_LINE = ROOT / "app" / "tools" / "tell-segment.py"
LAMPS = 0xF8
# SAMPLE_NOT_OP, SAMPLE_FAIL_SAFE: the frame carried none of the program's values.
UNREAL = 0x08 | 0x10


def start(segment: Segment) -> None:
    """The daemon with the example's own file; only the program's path is this build's."""
    program = next(BIN.parent.glob("lib*/**/ecdaq/control/loopback.so"))
    segment.settings["control.program"] = str(program)
    segment.start_sim("--control", str(segment.run_dir / "segment"))
    wait_for("control socket", (segment.run_dir / "segment").exists, 30)
    segment.start(
        "daemon",
        str(BIN / "ecdaqd"),
        *["--exit-on-failure", "--config", str(CONFIG)],
        *segment.options(),
        "--simulated",
    )
    segment.start_recorder()
    segment.wait_for_op()


def send_line(segment: Segment, line: str) -> dict[str, str]:
    command = [sys.executable, SEND_LINE, "--control", segment.run_dir / "segment", line]
    answer = subprocess.run(command, check=True, capture_output=True, text=True).stdout
    return dict(word.split("=") for word in answer.split())


def test_inputs_come_out_of_the_coupler_a_cycle_later(
    make_segment: Callable[..., Segment],
) -> None:
    segment = make_segment(slaves="wago_750_354")
    start(segment)
    for on in (1, 0, 1):
        send_line(segment, f"io slave=0 slot3.1={on}")
        wanted = LAMPS if on else 0
        wait_for(
            f"digital outputs {wanted:#x}",
            lambda wanted=wanted: int(send_line(segment, "io slave=0")["slot4"], 0) == wanted,
            60,
        )
        segment.wait_for_cycles(500, 60)
    segment.wait_for_cycles(1000, 60)
    assert segment.stop("daemon") == 0
    assert segment.stop("recorder") == 0
    check_recording(segment)


def check_recording(segment: Segment) -> None:
    """In each good sample behind a good one: what the program made of the inputs before."""
    samples = {s.cycle: s for s in recorded(segment.record_dir, "/ecdaq/wago0")}
    driven = {c.cycle for c in recorded(segment.record_dir, "/ecdaq/cycle") if not c.flags & UNREAL}
    pairs = [
        (samples[k], samples[k + 1])
        for k in sorted(driven)
        if k + 1 in driven and samples[k].good and samples[k + 1].good
    ]
    assert len(pairs) > 100
    for before, after in pairs:
        assert after.slot2_channel_1_data == before.slot1_channel_1_data, after.cycle
        lamps = {getattr(after, f"slot4_channel_{n}_data") for n in range(4, 9)}
        assert lamps == {before.slot3_channel_1_data}, after.cycle
    assert {before.slot3_channel_1_data for before, _ in pairs} == {False, True}
