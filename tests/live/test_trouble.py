# SPDX-License-Identifier: MIT
"""Errors of a first start: one line, what and why, and an exit code of its kind."""

from __future__ import annotations

import os
import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest
from segment import BIN, Segment, Undisturbed, wait_for

# These measure time, or need a cycle in time.
IDLE = True


def run_daemon(segment: Segment, *more: str) -> subprocess.CompletedProcess[str]:
    return segment.space.run(
        str(BIN / "ecdaqd"), "--exit-on-failure", *segment.options(), *more, check=False
    )


def only_line(got: subprocess.CompletedProcess[str]) -> str:
    """The one line of an error; warnings about missing real-time rights may precede it."""
    assert got.returncode != 0
    lines = [line for line in got.stderr.splitlines() if line.strip()]
    assert lines, "no message"
    assert lines[-1].startswith("ecdaqd: ")
    return lines[-1]


def test_a_nic_that_is_not_there_is_named_with_those_that_are(
    make_segment: Callable[..., Segment],
) -> None:
    segment = make_segment(settings={"bus.interface": "eth77"})
    line = only_line(run_daemon(segment))
    assert "eth77" in line and "ecat0" in line


@pytest.mark.skipif(os.geteuid() != 0, reason="needs root to give rights away")
def test_without_the_right_to_raw_sockets_the_line_names_it(
    make_segment: Callable[..., Segment],
) -> None:
    segment = make_segment()
    segment.run_dir.chmod(0o777)
    got = segment.space.run(
        "setpriv",
        "--reuid",
        "65534",
        "--clear-groups",
        "--inh-caps=-all",
        "--bounding-set=-all",
        str(BIN / "ecdaqd"),
        "--exit-on-failure",
        *segment.options(),
        check=False,
    )
    assert "CAP_NET_RAW" in only_line(got)


def test_a_bus_without_a_slave_is_reported(make_segment: Callable[..., Segment]) -> None:
    segment = make_segment()
    assert "no slave" in only_line(run_daemon(segment))


def configured(segment: Segment, slaves: list[dict[str, str]]) -> Path:
    file = segment.folder / "ecdaq.yaml"
    text = "slaves:\n"
    for slave in slaves:
        for i, (key, value) in enumerate(slave.items()):
            text += f"  {'-' if i == 0 else ' '} {key}: {value}\n"
    file.write_text(text)
    return file


PICCOLO = {"vendor": "0x00000002", "product": "0x04570862", "revision": "0x0258008d"}


def test_a_wrong_slave_is_named_by_position_and_identity(
    make_segment: Callable[..., Segment],
) -> None:
    segment = make_segment()
    segment.start_sim()
    file = configured(segment, [PICCOLO, PICCOLO | {"product": "0x0afe1234"}])
    line = only_line(run_daemon(segment, "--config", str(file)))
    for word in ("1", "0x0afe1234", "0x04570862"):
        assert word in line


@pytest.mark.parametrize("wanted", [1, 3])
def test_a_wrong_number_of_slaves_is_reported(
    make_segment: Callable[..., Segment], wanted: int
) -> None:
    segment = make_segment()
    segment.start_sim()
    file = configured(segment, [PICCOLO] * wanted)
    line = only_line(run_daemon(segment, "--config", str(file), "--set", "bus.presence=exact"))
    assert "2" in line and str(wanted) in line


def test_a_second_instance_is_refused_and_the_first_continues(
    make_segment: Callable[..., Segment],
) -> None:
    segment = make_segment()
    segment.start_all()
    undisturbed = Undisturbed(segment)
    line = only_line(run_daemon(segment))
    assert "already" in line or "running" in line
    segment.wait_for_cycles(1000, 60)
    undisturbed.check()


def test_a_second_segment_at_one_interface_is_refused_and_the_first_continues(
    make_segment: Callable[..., Segment],
) -> None:
    segment = make_segment()
    segment.start_all()
    undisturbed = Undisturbed(segment)
    got = segment.space.run(str(BIN / "ecdaq-sim"), "--interface", "ecsim0", check=False)
    assert got.returncode == 1
    assert got.stderr == "ecdaq-sim: interface ecsim0: another ecdaq-sim already uses it\n"
    segment.wait_for_cycles(1000, 60)
    undisturbed.check()


def test_an_sdo_the_slave_refuses_is_an_error_with_its_abort_code(
    make_segment: Callable[..., Segment],
) -> None:
    segment = make_segment()
    segment.start_sim()
    file = segment.folder / "ecdaq.yaml"
    file.write_text(
        "slaves:\n  - name: a\n    sdo:\n"
        "      - { index: 0x9999, subindex: 1, type: USINT, value: 1 }\n"
    )
    line = only_line(run_daemon(segment, "--config", str(file), "--set", "bus.presence=any"))
    assert "0x9999" in line and "06020000" in line


@pytest.mark.skipif(os.geteuid() != 0, reason="needs root to mount a small file system")
def test_a_full_disk_stops_the_recording_and_never_the_cycle(
    make_segment: Callable[..., Segment],
) -> None:
    segment = make_segment(
        settings={
            "record.reserve": "1MiB",
            "record.compression": "0",
            "record.when_full": "stop",
        }
    )
    segment.record_dir.mkdir()
    segment.space.run("mount", "-t", "tmpfs", "-o", "size=3m", "none", str(segment.record_dir))
    segment.start_all()
    undisturbed = Undisturbed(segment)
    wait_for(
        "the alarm", lambda: "disk" in segment.status().get("recorder", {}).get("state", ""), 60
    )
    segment.wait_for_cycles(2000, 60)
    undisturbed.check()


def test_a_port_of_the_machines_network_is_refused_unless_forced(
    make_segment: Callable[..., Segment],
) -> None:
    segment = make_segment()
    segment.start_sim()
    segment.space.run("ip", "address", "add", "192.0.2.7/24", "dev", "ecat0")
    got = run_daemon(segment)
    line = only_line(got)
    assert "ecat0" in line and "192.0.2.7" in line and "--force" in line
    assert got.returncode == 6
    segment.start_daemon("--force")
    segment.wait_for_op()


def test_a_port_with_the_default_route_is_refused(make_segment: Callable[..., Segment]) -> None:
    segment = make_segment()
    segment.space.run("ip", "route", "add", "default", "dev", "ecat0")
    got = run_daemon(segment)
    assert "default route" in only_line(got)
    assert got.returncode == 6
