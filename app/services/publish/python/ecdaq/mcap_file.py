# SPDX-License-Identifier: MIT
"""Records samples, events and time maps as MCAP like the appliance's own recordings.

Not published, and so zero here: of /ecdaq/cycle the clocks, times and working counters, of
/ecdaq/event mono_ns and id; sequence is 2^64-1 in every event.
"""

from __future__ import annotations

import datetime
import json
import math
import re
import struct
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from mcap.writer import CompressionType, Writer

from ecdaq.link import Channel, Channels

PACKAGE = "ecdaq_msgs/msg"
UNKNOWN_SEQUENCE = 2**64 - 1
# A slave's samples may arrive this many cycles after another's before they count as missing.
LATE_CYCLES = 5000
CDR_LE = b"\x00\x01\x00\x00"

CYCLE = """\
# One cycle of the master, as far as it is published.
uint64 cycle  # index of the SYNC0 edge, one more in every message
int64 dc_time_ns  # DC time of that edge, ns since 2000-01-01; 0 without DC
int64 wake_mono_ns  # not published: 0
int64 wake_tai_ns  # not published: 0
int64 frame_dc_ns  # not published: 0
int32 wake_latency_ns  # not published: 0
int32 round_trip_ns  # not published: 0
int32 phase_error_ns  # not published: 0
int32 dc_diff_ns  # not published: 0
uint32 flags  # 1 lost, 2 late, 4 WKC low, 8 not OP, 16 fail-safe, 32 skipped, 64 bad counter, \
128 DC unlocked, 256 doubled, 512 unchecked
uint16 wkc  # not published: 0
uint16 wkc_expected  # not published: 0
uint8[<=64] slaves_bad  # bit n % 8 of octet n / 8: the sample of slave n is not good
"""
EVENT = """\
# Something that happened.
int64 time_ns  # Unix time
int64 mono_ns  # not published: 0
uint64 sequence  # not published: 2^64-1
uint64 cycle  # in which it was noticed
int64 value  # see text
int32 arg0  # see text
int32 arg1  # see text
int32 slave  # position; -1: none
uint16 id  # not published: 0
string name  # for machines
string severity  # info, notice, warning, error
string text  # for people
"""
TIMEMAP = """\
# DC time to UTC: utc = utc_ns + (dc - dc_ns) * (1 + rate_ppb / 1e9).
int64 dc_ns  # DC time; without DC: cycle number times period
int64 utc_ns  # Unix time at dc_ns
int64 rate_ppb  # UTC against DC
int64 uncertainty_ns  # of utc_ns against the host's clock
int64 step_ns  # size of the newest step of the host's clock
uint64 steps  # number of steps so far
int32 tai_offset_s  # TAI minus UTC; 0: unset, CLOCK_TAI is taken for UTC
int64 clock_error_ns  # not published: -1
int64 clock_estimate_ns  # not published: -1
"""
SEPARATOR = "=" * 80 + "\n"
HEADER_DEFINITIONS = (
    f"{SEPARATOR}MSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n"
    f"{SEPARATOR}MSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n"
)
# stamp, an empty frame_id, padding; cycle, dc_time_ns, flags, good
HEAD = "<4sIIIB3xQqIB"
CYCLE_BYTES = struct.Struct("<4sQqqqqiiiiIHHI")  # and the octets of slaves_bad
TIMEMAP_BYTES = struct.Struct("<4sqqqqqQi4xqq")
EVENT_BYTES = struct.Struct("<4sqqQQqiiiH")
# ROS type and struct letter for 1, 2, 4, 8 bytes.
UNSIGNED = [("uint8", "B"), ("uint16", "H"), ("uint32", "I"), ("uint64", "Q")]
SIGNED = [("int8", "b"), ("int16", "h"), ("int32", "i"), ("int64", "q")]


def size_of(bits: int) -> int:
    """0, 1, 2, 3 for what fits in 1, 2, 4, 8 bytes."""
    return next(k for k in range(4) if bits <= 8 << k)


def field_name(name: str) -> str:
    """As the recorder names it, except words reserved in some language: ecdaq uses none."""
    plain = re.sub(r"[^a-z0-9]+", "_", name.lower()).strip("_")
    return f"n_{plain}" if plain[:1].isdigit() else plain or "unnamed"


def is_scaled(channel: Channel) -> bool:
    return (channel.scale, channel.offset) != (1, 0)


class Field:
    """One number in a slave's message: a channel's raw value, or its physical one."""

    def __init__(self, channel: Channel, name: str, raw_name: str | None = None) -> None:
        kind, bits = re.fullmatch(r"([A-Z]+)(\d*)", channel.type).groups()  # type: ignore[union-attr]
        self.channel = channel
        self.name = name
        self.raw_name = raw_name  # of the raw field beside a physical one; None: it is raw
        self.bits = int(bits or 1)
        self.is_signed = kind == "INT"
        size = size_of(self.bits)
        if raw_name is not None:
            self.ros_type, self.letter, size = "float64", "d", 3
        elif kind == "BOOL":
            self.ros_type, self.letter = "bool", "B"
        elif kind == "FLOAT":  # its bits, as they are
            self.ros_type, self.letter = f"float{self.bits}", UNSIGNED[size][1]
        else:
            self.ros_type, self.letter = (SIGNED if self.is_signed else UNSIGNED)[size]
        self.bytes = 1 << size

    def value(self, sample: Any) -> int | float:
        """What the message has; a physical value of a sample that is not good is NaN."""
        if self.raw_name is not None:
            return sample.values[self.channel.place] if sample.is_good else math.nan
        raw: int = sample.raw[self.channel.place]
        return raw - (1 << self.bits) if self.is_signed and raw >> (self.bits - 1) else raw

    def comment(self) -> str:
        c = self.channel
        found = f"{c.name}, {'output' if c.is_output else 'input'}, {self.bits} bit"
        if self.raw_name is not None:
            return f"{found}; {c.unit or 'physical'}"
        if c.unit or is_scaled(c):
            found += f"; {c.unit or 'value'} = raw * {c.scale!r} + {c.offset!r}"
        return found

    def metadata(self) -> dict[str, str]:
        c = self.channel
        scale, offset = (c.scale, c.offset) if self.raw_name is None else (1.0, 0.0)
        found = {
            f"{self.name}.channel": c.name, f"{self.name}.unit": c.unit,
            f"{self.name}.scale": f"{scale:.17g}", f"{self.name}.offset": f"{offset:.17g}",
        }  # fmt: skip
        if self.raw_name is not None:
            found[f"{self.name}.raw"] = self.raw_name
        return found


class SlaveTopic:
    """How one slave's samples are written."""

    def __init__(self, name: str, device: str, position: int, channels: Iterable[Channel]) -> None:
        self.name = name
        self.topic = f"/ecdaq/{field_name(name)}"
        self.type = "".join(w[:1].upper() + w[1:] for w in field_name(name).split("_"))
        self.position = position
        self.device = device
        self.fields: list[Field] = []
        self._taken = {"header", "cycle", "dc_time_ns", "flags", "good"}
        for channel in channels:
            plain = field_name(channel.entry)
            if is_scaled(channel):
                physical, raw = self._unique(plain), self._unique(f"{plain}_raw")
                self.fields += [Field(channel, physical, raw), Field(channel, raw)]
            else:
                self.fields.append(Field(channel, self._unique(plain)))
        layout, at = HEAD, struct.calcsize(HEAD) - len(CDR_LE)
        for field in self.fields:
            pad = -at % field.bytes
            layout += f"{pad}x{field.letter}"
            at += pad + field.bytes
        self.struct = struct.Struct(layout)

    def _unique(self, name: str) -> str:
        found, number = name, 2
        while found in self._taken:
            found, number = f"{name}_{number}", number + 1
        self._taken.add(found)
        return found

    def schema(self) -> str:
        lines = [
            f"# Slave {self.name} at position {self.position}: {self.device}.",
            "std_msgs/Header header  # stamp: UTC of that edge, as the log time",
            "uint64 cycle  # index of the SYNC0 edge, one more in every message",
            "int64 dc_time_ns  # DC time of that edge, ns since 2000-01-01",
            f"uint32 flags  # as in {PACKAGE}/Cycle",
            "bool good  # fresh, and the slave's own checks hold",
            *(f"{field.ros_type} {field.name}  # {field.comment()}" for field in self.fields),
        ]
        return "\n".join(lines) + "\n" + HEADER_DEFINITIONS

    def metadata(self) -> dict[str, str]:
        found = {
            "offered_qos_profiles": "", "slave": self.name, "position": str(self.position)
        }  # fmt: skip
        for field in self.fields:
            found |= field.metadata()
        return found

    def encode(self, sample: Any) -> bytes:
        seconds, ns = divmod(max(0, sample.utc_ns), 10**9)
        return self.struct.pack(
            CDR_LE, seconds & 0xFFFFFFFF, ns, 1, 0, sample.cycle, sample.dc_time_ns, sample.flags,
            sample.is_good, *(field.value(sample) for field in self.fields),
        )  # fmt: skip


def put_string(data: bytes, text: str) -> bytes:
    coded = text.encode() + b"\0"
    pad = -(len(data) - len(CDR_LE)) % 4
    return data + bytes(pad) + struct.pack("<I", len(coded)) + coded


def encode_event(event: Any) -> bytes:
    data = EVENT_BYTES.pack(
        CDR_LE, event.utc_ns, 0, UNKNOWN_SEQUENCE, event.cycle, event.value, event.arg0,
        event.arg1, event.slave, 0,
    )  # fmt: skip
    for text in (event.name, event.severity, event.text):
        data = put_string(data, text)
    return data


def encode_timemap(m: Any) -> bytes:
    return TIMEMAP_BYTES.pack(
        CDR_LE, m.dc_ns, m.utc_ns, m.rate_ppb, m.uncertainty_ns, m.step_ns, m.steps,
        m.tai_offset_s, -1, -1,
    )  # fmt: skip


class McapFile:
    """The recording of one session of the master, NAME.mcap.part until it is closed."""

    def __init__(self, folder: Path, channels: Channels, program: str) -> None:
        folder.mkdir(parents=True, exist_ok=True)
        number = 1 + max(
            (int(p.name[-11:-5]) for p in folder.glob("ecdaq-*-??????.mcap")), default=0
        )
        now = datetime.datetime.now(datetime.UTC).strftime("%Y%m%dT%H%M%SZ")
        started_ms = channels.session // 1_000_000 & 0xFFFFFFFF
        name = f"ecdaq-{now}-{started_ms:08x}-{number:06d}.mcap"
        self.path = folder / name
        self.part = folder / f"{name}.part"
        self.session = channels.session
        self.number = number
        self.program = program
        self.channels = channels
        self.slaves = [
            SlaveTopic(slave, channels.slave_devices[i], i, channels.of_slave(i))
            for i, slave in enumerate(channels.slave_names)
        ]
        self.cycles = 0
        self.last_cycle = -1
        self._stream = self.part.open("wb")
        self._writer = Writer(self._stream, compression=CompressionType.ZSTD)
        self._writer.start(profile="ros2", library=program)
        self._ids = {
            "cycle": self._register("/ecdaq/cycle", "Cycle", CYCLE, {"offered_qos_profiles": ""}),
            "event": self._register("/ecdaq/event", "Event", EVENT, {"offered_qos_profiles": ""}),
            "timemap": self._register(
                "/ecdaq/timemap", "TimeMap", TIMEMAP, {"offered_qos_profiles": ""}
            ),
        }
        self._slave_ids = [
            self._register(s.topic, s.type, s.schema(), s.metadata()) if s.fields else None
            for s in self.slaves
        ]
        self._pending: dict[int, list[int]] = {}  # cycle: dc, utc, flags, bad, samples
        self._waiting: list[Any] = []  # until every slave has sent a sample
        self._first: dict[int, int] = {}
        self._put_channels()

    def _register(self, topic: str, kind: str, schema: str, metadata: dict[str, str]) -> int:
        number = self._writer.register_schema(f"{PACKAGE}/{kind}", "ros2msg", schema.encode())
        return self._writer.register_channel(topic, "cdr", number, metadata)

    def _put_channels(self) -> None:
        listed = [
            {
                "name": f.channel.name, "topic": s.topic, "field": f.name,
                "raw_field": f.raw_name or f.name, "slave": s.position, "type": f.channel.type,
                "direction": "output" if f.channel.is_output else "input", "bit_len": f.bits,
                "unit": f.channel.unit, "scale": f.channel.scale, "offset": f.channel.offset,
            }
            for s in self.slaves
            for f in s.fields
            if f.raw_name is not None or not is_scaled(f.channel)
        ]  # fmt: skip
        slaves = [{"name": s.name, "device": s.device, "position": s.position} for s in self.slaves]
        fields = {"period_ns": self.channels.period_ns, "slaves": slaves, "channels": listed}
        self._writer.add_metadata("ecdaq.channels", {"json": json.dumps(fields)})

    def _put_session(self, first_cycle: int) -> None:
        fields = {
            "program": self.program, "session": self.session, "file_sequence": self.number,
            "period_ns": self.channels.period_ns, "next_cycle": first_cycle, "first_cycle": 0,
            "cycles_before": 0, "gaps_before": 0, "cycles_missing_before": 0, "event_next": 0,
            "event_mono_ns": 0, "slaves": len(self.slaves), "channels": len(self.channels),
        }  # fmt: skip
        self._writer.add_metadata("ecdaq.session", {k: str(v) for k, v in fields.items()})

    def _put(self, channel: int, utc_ns: int, data: bytes) -> None:
        time_ns = max(0, utc_ns)
        self._writer.add_message(channel, log_time=time_ns, publish_time=time_ns, data=data)

    def add(self, sample: Any) -> None:
        """Add a sample of any slave. The file begins with the first cycle that all slaves have."""
        if len(self._first) < len(self.slaves):
            self._first.setdefault(sample.slave, sample.cycle)
            self._waiting.append(sample)
            if len(self._first) == len(self.slaves):
                waiting, self._waiting = self._waiting, []
                self._put_session(max(self._first.values()))
                for early in waiting:
                    self._add(early)
            return
        self._add(sample)

    def _add(self, sample: Any) -> None:
        if sample.cycle < max(self._first.values()):
            return
        channel = self._slave_ids[sample.slave]
        if channel is not None:
            self._put(channel, sample.utc_ns, self.slaves[sample.slave].encode(sample))
        entry = self._pending.setdefault(
            sample.cycle, [sample.dc_time_ns, sample.utc_ns, sample.flags, 0, 0]
        )
        if not sample.is_good:
            entry[3] |= 1 << sample.slave
        entry[4] += 1
        if entry[4] == len(self.slaves):
            self._flush(sample.cycle - LATE_CYCLES)

    def _flush(self, too_old: int) -> None:
        """Write complete cycles in order, and incomplete ones up to @too_old."""
        for cycle in sorted(self._pending):
            dc, utc, flags, bad, samples = self._pending[cycle]
            if samples < len(self.slaves) and cycle > too_old:
                return
            del self._pending[cycle]
            octets = bad.to_bytes((len(self.slaves) + 7) // 8, "little")
            head = CYCLE_BYTES.pack(
                CDR_LE, cycle, dc, 0, 0, 0, 0, 0, 0, 0, flags, 0, 0, len(octets)
            )  # fmt: skip
            self._put(self._ids["cycle"], utc, head + octets)
            self.cycles += 1
            self.last_cycle = cycle

    def add_event(self, event: Any) -> None:
        self._put(self._ids["event"], event.utc_ns, encode_event(event))

    def add_timemap(self, m: Any) -> None:
        self._put(self._ids["timemap"], m.utc_ns, encode_timemap(m))
        names = (
            "dc_ns", "utc_ns", "rate_ppb", "uncertainty_ns", "step_ns", "steps", "tai_offset_s"
        )  # fmt: skip
        fields = {name: str(getattr(m, name)) for name in names}
        self._writer.add_metadata("ecdaq.timemap", fields | {"quality": m.quality})

    def close(self, reason: str) -> Path:
        """Complete the file. Returns its path."""
        if len(self._first) < len(self.slaves):
            self._put_session(0)
        self._flush(-1)
        fields = {
            "reason": reason, "cycles": self.cycles, "last_cycle": max(0, self.last_cycle),
        }  # fmt: skip
        self._writer.add_metadata("ecdaq.end", {k: str(v) for k, v in fields.items()})
        self._writer.finish()
        self._stream.close()
        self.part.rename(self.path)
        return self.path
