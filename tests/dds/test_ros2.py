# SPDX-License-Identifier: MIT
"""The mirror for ROS 2: its names, its fields, and that its values are those of ecdaq/sample."""

# No "from __future__ import annotations": cyclonedds reads the annotations as they are.

import re
from collections.abc import Callable
from dataclasses import dataclass

from bench import ROOT, Bench, live
from cyclonedds.idl import IdlStruct, types
from cyclonedds.idl.annotations import final

PUBLISH = ROOT / "app" / "services" / "publish"
# rosidl's names of the types of IDL.
ROS = {
    "boolean": "bool", "double": "float64", "unsigned short": "uint16",
    "unsigned long": "uint32", "unsigned long long": "uint64", "long long": "int64",
    "sequence<double>": "float64[]", "sequence<unsigned long long>": "uint64[]",
}  # fmt: skip


@dataclass
@final
class Sample(IdlStruct, typename="ecdaq_msgs.msg.dds_.Sample_"):
    slave_: types.uint16
    session_: types.uint64
    cycle_: types.uint64
    dc_time_ns_: types.int64
    utc_ns_: types.int64
    flags_: types.uint32
    is_good_: bool
    adc_: types.float64
    counter_: types.uint64
    sample_time_ns_: types.int64
    values_: types.sequence[types.float64]
    raw_: types.sequence[types.uint64]


def members(file: str, struct: str) -> list[tuple[str, str]]:
    text = re.sub(r"//.*", "", (PUBLISH / "idl" / file).read_text())
    body = re.search(rf"struct {struct} \{{(.*?)\}};", text, re.DOTALL)
    assert body
    lines = filter(None, map(str.strip, body.group(1).split(";")))
    return [tuple(line.removeprefix("@key ").rsplit(" ", 1)) for line in lines]  # type: ignore[misc]


def test_mirror_message_and_sample_have_the_same_fields() -> None:
    mirror = [(kind, name.removesuffix("_")) for kind, name in members("ros2.idl", "Sample_")]
    assert mirror == members("ecdaq.idl", "SampleV1")
    text = re.sub(r"#.*", "", (PUBLISH / "ros2/ecdaq_msgs/msg/Sample.msg").read_text())
    assert [tuple(line.split()) for line in text.splitlines() if line.strip()] == [
        (ROS[kind], name) for kind, name in mirror
    ]
    assert Sample.__idl__.idl_transformed_typename == "ecdaq_msgs::msg::dds_::Sample_"


def test_mirror_equals_the_recording(
    make_bench: Callable[..., Bench],
) -> None:
    bench = make_bench(**{"dds.ros2_mirror": "on"})
    bench.start_all()
    out = bench.folder / "ros2.csv"
    bench.python("ros2", "subscribe_ros2.py", "dds1", "7", "3000", str(out))
    for process in bench.started:
        assert process.wait(120) == 0, bench.logs()
    assert bench.segment.stop("dds") == 0
    bench.segment.stop("daemon")
    assert bench.segment.stop("recorder") == 0
    got = [tuple(map(int, line.split(","))) for line in out.read_text().splitlines()]
    assert len(got) >= 3000
    assert {slave for slave, *_ in got} == {0, 1}
    for slave in (0, 1):
        recorded = {
            m.cycle: (m.adc_raw, m.counter)
            for m in live.recorded(bench.segment.record_dir, f"/ecdaq/piccolo{slave}")
        }
        mine = {cycle: (adc, counter) for s, cycle, adc, counter in got if s == slave}
        assert {cycle: recorded[cycle] for cycle in mine} == mine
        assert sorted(mine) == list(range(min(mine), max(mine) + 1))
