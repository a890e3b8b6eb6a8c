# SPDX-License-Identifier: MIT
"""The connection to an appliance."""

from __future__ import annotations

import ctypes
import os
import re
import socket
import time
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import TypeVar

from cyclonedds.core import (
    DDSException,
    InstanceState,
    Policy,
    Qos,
    ReadCondition,
    SampleState,
    ViewState,
    WaitSet,
)
from cyclonedds.domain import Domain, DomainParticipant
from cyclonedds.internal import DDS
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from cyclonedds.util import duration

from ecdaq.errors import InterfaceError, LinkError, NoAnswerError, RefusedError
from ecdaq.idl_types import (
    TOPICS,
    BlockV1,
    ChannelsV1,
    CommandV1,
    EventV1,
    IdlV1,
    ReplyV1,
    SampleV1,
    StatusV1,
    TimeMapV1,
)
from ecdaq.keys import security_config
from ecdaq.series import Gaps, Sampled

State = TypeVar("State", ChannelsV1, IdlV1, StatusV1, TimeMapV1)
ANY = ViewState.Any | InstanceState.Any | SampleState.Any
TAKE_AT_ONCE = 4096
# Below the lifespan of a command, which is 1 s.
REPEAT_S = 0.5


def _matched(what: str, entity: DataWriter | DataReader) -> int:
    """How many subscriptions of a writer, publications of a reader: 0.10 has no method for it."""
    count = DDS._dll_handle[f"dds_get_matched_{what}"]
    count.argtypes = [ctypes.c_int32, ctypes.c_void_p, ctypes.c_size_t]
    return count(entity._ref, None, 0)


@dataclass(frozen=True)
class Channel:
    """One variable of a slave."""

    name: str
    unit: str
    type: str
    slave: int
    place: int  # index in values and raw of the slave's samples
    is_output: bool
    scale: float
    offset: float
    owner: str
    timeout_s: float

    @property
    def entry(self) -> str:
        """The name without the slave's: "adc" of "piccolo0.adc"."""
        return self.name.rpartition(".")[2]

    def value(self, sample: Sampled) -> int | float:
        """The physical value; exact, as an int, where the channel is an unscaled integer."""
        if (self.scale, self.offset) != (1, 0) or self.type.startswith("FLOAT"):
            return sample.values[self.place]
        raw = sample.raw[self.place]
        bits = int(self.type[3:]) if self.type.startswith("INT") else 64
        return raw - (1 << bits) if self.type.startswith("INT") and raw >> (bits - 1) else raw


class Channels:
    """The channel table of one session."""

    def __init__(self, message: ChannelsV1) -> None:
        self.session: int = message.session
        self.period_ns: int = message.period_ns
        self.slave_names: list[str] = list(message.slave_name)
        self.slave_devices: list[str] = list(message.slave_device)
        self.command_lease_ns: int = message.command_lease_ns
        self.are_commands_on: bool = message.are_commands_on
        self.all: list[Channel] = []
        places: dict[int, int] = {}
        for i, name in enumerate(message.name):
            slave = message.slave[i]
            place = places.get(slave, 0)
            places[slave] = place + 1
            self.all.append(
                Channel(
                    name=name,
                    unit=message.unit[i],
                    type=message.type[i],
                    slave=slave,
                    place=place,
                    is_output=message.is_output[i],
                    scale=message.scale[i],
                    offset=message.offset[i],
                    owner=message.owner[i],
                    timeout_s=message.timeout_ns[i] / 1e9,
                )
            )

    def of_slave(self, slave: int) -> list[Channel]:
        return [c for c in self.all if c.slave == slave]

    def __getitem__(self, name: str) -> Channel:
        for channel in self.all:
            if channel.name == name:
                return channel
        raise KeyError(name)

    def __iter__(self) -> Iterator[Channel]:
        return iter(self.all)

    def __len__(self) -> int:
        return len(self.all)


def domain_config(interface: str, multicast: bool, peers: list[str], tag: str) -> str:
    """The same configuration as that of ecdaq-dds, without security."""
    for word in [interface, tag, *peers]:
        if not re.fullmatch(r"[A-Za-z0-9._:-]*", word):
            raise ValueError(f"{word!r}: invalid character: allowed are letters, digits, . _ : -")
    is_loopback = interface == "lo"
    found = (["localhost"] if is_loopback else []) + peers
    listed = "".join(f'<Peer Address="{peer}"/>' for peer in found)
    return (
        f'<General><Interfaces><NetworkInterface name="{interface}" presence_required="false"/>'
        f"</Interfaces><AllowMulticast>{str(multicast and not is_loopback).lower()}"
        "</AllowMulticast></General><Discovery><ParticipantIndex>auto</ParticipantIndex>"
        "<MaxAutoParticipantIndex>99</MaxAutoParticipantIndex>"
        + (f"<Tag>{tag}</Tag>" if tag else "")
        + (f"<Peers>{listed}</Peers>" if found else "")
        + "</Discovery>"
    )


def connect(
    interface: str,
    *,
    domain: int = 0,
    multicast: bool = True,
    peers: list[str] | None = None,
    tag: str = "",
    commander: str = "",
    security: str | Path | None = None,
) -> Link:
    """Join the appliance's DDS domain on @interface, and on no other.

    @security: the directory with our keys; default: $ECDAQ_SECURITY, or none.
    Raises InterfaceError, LinkError if the domain cannot be joined, ValueError for bad arguments.
    """
    names = [name for _, name in socket.if_nameindex()]
    if interface not in names:
        raise InterfaceError(
            f"{interface}: no such network interface: use one of {' '.join(names)}"
        )
    config = domain_config(interface, multicast, peers or [], tag)
    keys = security or os.environ.get("ECDAQ_SECURITY")
    if keys:
        config += security_config(Path(keys))
    return Link(domain, config, commander)


class Link:
    """A DDS participant. Readers are created when they are first used."""

    def __init__(self, domain: int, config: str, commander: str = "") -> None:
        try:
            self.domain = Domain(domain, config)
            self.participant = DomainParticipant(domain)
        except DDSException as error:
            raise LinkError(
                f"cannot join DDS domain {domain}: {error.msg}: is the interface up, with an "
                "address, and is the domain 0 to 230?"
            ) from error
        self.gaps = Gaps()
        self.commander = commander or f"{os.uname().nodename}-{os.getpid()}"
        self._last_id = 0
        self._readers: dict[str, DataReader] = {}
        self._writer: DataWriter | None = None
        self._channels: Channels | None = None
        self._newest_cycle = 0
        self._is_stopped = False

    def __enter__(self) -> Link:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        value: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    def close(self) -> None:
        """Leave the domain. Outputs that we have set go fail-safe if they have a timeout."""
        self._readers.clear()
        self._writer = None
        del self.participant
        del self.domain

    def stop(self) -> None:
        """End subscribe() and blocks() soon; for signal handlers, which must not raise into DDS."""
        self._is_stopped = True

    def reader(self, kind: type, *, topic: str = "", is_state: bool = False) -> DataReader:
        """The reader of a type on its topic, or on @topic if that is given.

        RELIABLE, KEEP_ALL; with @is_state: TRANSIENT_LOCAL, KEEP_LAST 1.
        """
        topic = topic or TOPICS[kind]
        if topic not in self._readers:
            qos = Qos(
                Policy.Reliability.Reliable(duration(milliseconds=100)),
                Policy.Durability.TransientLocal if is_state else Policy.Durability.Volatile,
                Policy.History.KeepLast(1) if is_state else Policy.History.KeepAll,
            )
            found = Topic(self.participant, topic, kind)
            self._readers[topic] = DataReader(self.participant, found, qos=qos)
        return self._readers[topic]

    def _take(self, reader: DataReader, seconds: float) -> list:
        """Take what is there, else wait up to @seconds for the first; without invalid samples."""
        waitset = WaitSet(self.participant)
        condition = ReadCondition(reader, ANY)
        waitset.attach(condition)
        if seconds > 0:
            waitset.wait(duration(seconds=seconds))
        taken = reader.take(N=TAKE_AT_ONCE)
        return [m for m in taken if m.sample_info.valid_data]

    def _newest(self, kind: type[State], seconds: float) -> State:
        reader = self.reader(kind, is_state=True)
        end = time.monotonic() + seconds
        while True:
            found = [m for m in reader.read(N=16) if m.sample_info.valid_data]
            if found:
                return found[-1]
            left = end - time.monotonic()
            if left <= 0:
                raise NoAnswerError(
                    f"no {TOPICS[kind]} within {seconds:g} s: is ecdaq-dds running, in the same "
                    "domain and with the same tag?"
                )
            waitset = WaitSet(self.participant)
            waitset.attach(ReadCondition(reader, ANY))
            waitset.wait(duration(seconds=left))

    def channels(self, seconds: float = 10) -> Channels:
        """The channel table of the running master."""
        message = self._newest(ChannelsV1, seconds)
        if self._channels is None or self._channels.session != message.session:
            self._channels = Channels(message)
        return self._channels

    def status(self, seconds: float = 10) -> StatusV1:
        return self._newest(StatusV1, seconds)

    def timemap(self, seconds: float = 10) -> TimeMapV1:
        return self._newest(TimeMapV1, seconds)

    def idl(self, seconds: float = 10) -> str:
        """The text of ecdaq.idl as published."""
        return self._newest(IdlV1, seconds).text

    def subscribe(
        self, seconds: float | None = None, slave: int | None = None
    ) -> Iterator[SampleV1]:
        """Samples as they arrive, for @seconds or without end; gaps are counted in .gaps."""
        reader = self.reader(SampleV1)
        end = None if seconds is None else time.monotonic() + seconds
        while not self._is_stopped and (end is None or time.monotonic() < end):
            left = 1.0 if end is None else min(1.0, max(0.001, end - time.monotonic()))
            for sample in self._take(reader, left):
                self.gaps.take(sample)
                self._newest_cycle = sample.cycle
                if slave is None or sample.slave == slave:
                    yield sample
                if self._is_stopped:
                    return

    def blocks(self, seconds: float | None = None) -> Iterator[BlockV1]:
        """Blocks as they arrive; gaps are not counted."""
        reader = self.reader(BlockV1)
        end = None if seconds is None else time.monotonic() + seconds
        while not self._is_stopped and (end is None or time.monotonic() < end):
            left = 1.0 if end is None else min(1.0, max(0.001, end - time.monotonic()))
            yield from self._take(reader, left)

    def events(self, seconds: float) -> list[EventV1]:
        """Events since the last call; if there are none, wait up to @seconds for the first."""
        return self._take(self.reader(EventV1), seconds)

    # Commands

    def _command_writer(self) -> DataWriter:
        if self._writer is None:
            lease_ns = self.channels().command_lease_ns
            qos = Qos(
                Policy.Reliability.Reliable(duration(milliseconds=100)),
                Policy.History.KeepLast(1),
                Policy.Lifespan(duration(seconds=1)),
                Policy.Liveliness.Automatic(lease_ns),
            )
            topic = Topic(self.participant, TOPICS[CommandV1], CommandV1)
            self._writer = DataWriter(self.participant, topic, qos=qos)
            self._wait_for_match(self._writer, self.reader(ReplyV1))
        return self._writer

    def _wait_for_match(self, writer: DataWriter, replies: DataReader, seconds: float = 10) -> None:
        end = time.monotonic() + seconds
        while not (_matched("subscriptions", writer) and _matched("publications", replies)):
            if time.monotonic() > end:
                raise NoAnswerError("no ecdaq-dds accepts commands in this domain")
            time.sleep(0.01)

    def send(
        self,
        values: Mapping[str, float],
        *,
        raw: bool = False,
        not_after_cycle: int = 0,
        session: int = 0,
        message_id: int | None = None,
    ) -> int:
        """Send a command without waiting for its reply. Returns the command's id."""
        bits = [int(v) for v in values.values()] if raw else []
        if any(not 0 <= b < 1 << 64 for b in bits):
            raise ValueError(f"{bits}: a raw value is 0 to 2**64 - 1")
        writer = self._command_writer()
        if message_id is None:
            self._last_id += 1
            message_id = self._last_id
        writer.write(
            CommandV1(
                commander=self.commander,
                id=message_id,
                session=session,
                not_after_cycle=not_after_cycle,
                is_raw=raw,
                channel=list(values),
                values=[] if raw else [float(v) for v in values.values()],
                raw=bits,
            )
        )
        return message_id

    def replies(self, seconds: float) -> list[ReplyV1]:
        """Replies to our commands; if there are none, wait up to @seconds for the first."""
        taken = self._take(self.reader(ReplyV1), seconds)
        return [r for r in taken if r.commander == self.commander]

    def command(
        self,
        values: Mapping[str, float],
        *,
        raw: bool = False,
        not_after_cycle: int = 0,
        session: int = 0,
        seconds: float = 2,
    ) -> int:
        """Set outputs, all in one cycle or none. Returns the cycle whose frame carried them.

        Without a reply the command is repeated: right after discovery, or on a lossy network, it or
        its reply can be lost. The appliance executes it once.

        Values hold while this link is alive and the appliance receives its liveliness; then outputs
        with a timeout go fail-safe. Raises RefusedError with the reason if the command is rejected.
        """
        number = None
        end = time.monotonic() + seconds
        while (now := time.monotonic()) < end:
            number = self.send(
                values,
                raw=raw,
                not_after_cycle=not_after_cycle,
                session=session,
                message_id=number,
            )
            repeat = min(end, now + REPEAT_S)
            while (left := repeat - time.monotonic()) > 0:
                for reply in self.replies(left):
                    if reply.id == number and reply.is_accepted:
                        return reply.cycle
                    if reply.id == number:
                        raise RefusedError(reply.reason)
        raise NoAnswerError(f"no reply within {seconds:g} s")
