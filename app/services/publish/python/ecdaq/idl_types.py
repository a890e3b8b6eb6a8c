# SPDX-License-Identifier: MIT
"""The types of app/services/publish/idl/ecdaq.idl, member by member; a test compares the two."""

# No "from __future__ import annotations": cyclonedds reads the annotations as they are.

from dataclasses import dataclass

from cyclonedds.idl import IdlStruct, types
from cyclonedds.idl.annotations import final, key


@dataclass
@final
class SampleV1(IdlStruct, typename="ecdaq.SampleV1"):
    slave: types.uint16
    key("slave")
    session: types.uint64
    cycle: types.uint64
    dc_time_ns: types.int64
    utc_ns: types.int64
    flags: types.uint32
    is_good: bool
    adc: types.float64
    counter: types.uint64
    sample_time_ns: types.int64
    values: types.sequence[types.float64]
    raw: types.sequence[types.uint64]


@dataclass
@final
class BlockV1(IdlStruct, typename="ecdaq.BlockV1"):
    slave: types.uint16
    key("slave")
    session: types.uint64
    count: types.uint32
    channel_count: types.uint32
    cycle: types.sequence[types.uint64]
    dc_time_ns: types.sequence[types.int64]
    utc_ns: types.sequence[types.int64]
    flags: types.sequence[types.uint32]
    is_good: types.sequence[bool]
    adc: types.sequence[types.float64]
    counter: types.sequence[types.uint64]
    sample_time_ns: types.sequence[types.int64]
    values: types.sequence[types.float64]
    raw: types.sequence[types.uint64]


@dataclass
@final
class ChannelsV1(IdlStruct, typename="ecdaq.ChannelsV1"):
    session: types.uint64
    period_ns: types.uint64
    slave_name: types.sequence[str]
    slave_device: types.sequence[str]
    slave_vendor: types.sequence[types.uint32]
    slave_product: types.sequence[types.uint32]
    name: types.sequence[str]
    unit: types.sequence[str]
    type: types.sequence[str]
    slave: types.sequence[types.uint16]
    is_output: types.sequence[bool]
    scale: types.sequence[types.float64]
    offset: types.sequence[types.float64]
    owner: types.sequence[str]
    minimum: types.sequence[types.float64]
    maximum: types.sequence[types.float64]
    fail_safe: types.sequence[types.float64]
    timeout_ns: types.sequence[types.int64]
    command_lease_ns: types.int64
    are_commands_on: bool


@dataclass
@final
class StatusV1(IdlStruct, typename="ecdaq.StatusV1"):
    session: types.uint64
    state: str
    message: str
    version: str
    is_simulated: bool
    is_fail_safe: bool
    slaves: types.uint16
    cycle: types.uint64
    cycles: types.uint64
    frames_lost: types.uint64
    frames_late: types.uint64
    wkc_low: types.uint64
    overruns: types.uint64
    samples_good: types.uint64
    samples_bad: types.uint64
    dc_state: str
    dc_diff_max_ns: types.int64
    cycles_published: types.uint64
    cycles_missed: types.uint64
    commands_accepted: types.uint64
    commands_refused: types.uint64


@dataclass
@final
class EventV1(IdlStruct, typename="ecdaq.EventV1"):
    session: types.uint64
    cycle: types.uint64
    utc_ns: types.int64
    name: str
    severity: str
    slave: types.int32
    value: types.int64
    arg0: types.int32
    arg1: types.int32
    text: str


@dataclass
@final
class TimeMapV1(IdlStruct, typename="ecdaq.TimeMapV1"):
    session: types.uint64
    dc_ns: types.int64
    utc_ns: types.int64
    rate_ppb: types.int64
    uncertainty_ns: types.int64
    step_ns: types.int64
    steps: types.uint64
    tai_offset_s: types.int32
    quality: str


@dataclass
@final
class Sync0V1(IdlStruct, typename="ecdaq.Sync0V1"):
    slave: types.uint16
    key("slave")
    line: types.uint16
    session: types.uint64
    utc_ns: types.int64
    source: str
    verdict: str
    first_cycle: types.uint64
    cycles: types.uint64
    edges: types.uint64
    missing: types.uint64
    extra: types.uint64
    overflow: types.uint64
    first_missing: types.uint64
    step_ns: types.int64
    period_ns: types.float64
    period_sd_ns: types.float64
    jitter_p99_ns: types.int64
    jitter_max_ns: types.int64
    drift_ppb: types.float64
    drift_error_ppb: types.float64
    rate_ppb: types.float64
    rate_error_ppb: types.float64
    phase_ns: types.int64
    phase_error_ns: types.int64
    frame_ns: types.int64
    skew_ns: types.int64
    skew_error_ns: types.int64
    dc_diff_ns: types.int64
    shot_dc_ns: types.int64
    shot_late_ns: types.int64
    has: types.uint32
    resolved: types.uint32


@dataclass
@final
class IdlV1(IdlStruct, typename="ecdaq.IdlV1"):
    text: str


@dataclass
@final
class CommandV1(IdlStruct, typename="ecdaq.CommandV1"):
    commander: str
    key("commander")
    id: types.uint64
    session: types.uint64
    not_after_cycle: types.uint64
    is_raw: bool
    channel: types.sequence[str]
    values: types.sequence[types.float64]
    raw: types.sequence[types.uint64]


@dataclass
@final
class ReplyV1(IdlStruct, typename="ecdaq.ReplyV1"):
    commander: str
    key("commander")
    id: types.uint64
    session: types.uint64
    is_accepted: bool
    cycle: types.uint64
    reason: str
