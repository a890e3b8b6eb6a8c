# SPDX-License-Identifier: MIT
"""Messages in the content of chunks, as rows of bytes: no step of Python for each message.

A cycle is recorded as the same few messages again and again, each with the same size. Where this
holds, the heads of all these messages are compared at once; messages that come in between, an event
say, are taken one by one.
"""

from __future__ import annotations

import functools
import struct
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ecdaq.container import OP_LAST, FormError
from ecdaq.definitions import Rows

OP_MESSAGE = 0x05
HEAD = struct.Struct("<BQH")  # opcode, length, channel
RECORD_HEAD_BYTES = 9
LAST_BYTES = 4
TIME_OFFSET = HEAD.size + 4  # log time, after the sequence number
DATA_OFFSET = RECORD_HEAD_BYTES + 22
ROWS_AT_ONCE = 1024
# A cycle of more messages than this is taken message by message.
PATTERN_RECORDS = 2048
PATTERN_RECORDS_LEAST = 16

Pattern = tuple[tuple[int, int, int], ...]  # opcode, length, channel of one record after the other


@dataclass(frozen=True)
class Block:
    """Messages of one channel and of the same size."""

    channel: int
    rows: Rows

    @property
    def times(self) -> np.ndarray:
        """Log time, ns."""
        return self.rows.view("<u8", TIME_OFFSET - DATA_OFFSET)


def record_bytes(pattern: Pattern) -> int:
    return sum(RECORD_HEAD_BYTES + length for _, length, _ in pattern)


@functools.lru_cache(256)
def heads_of(pattern: Pattern) -> list[tuple[int, np.uint64, np.uint32]]:
    """Of each record its length, and the first eight and the last four of the eleven bytes of
    opcode, length and channel."""
    found = []
    for opcode, length, channel in pattern:
        head = HEAD.pack(opcode, length, channel)
        numbers = (int.from_bytes(part, "little") for part in (head[:8], head[-LAST_BYTES:]))
        found.append((length, np.uint64(next(numbers)), np.uint32(next(numbers))))
    return found


class Scanner:
    """Goes through the content of chunks."""

    def __init__(self, data: bytes | memoryview, usual: Pattern = ()) -> None:
        self.data = data
        self.octets = np.frombuffer(data, np.uint8)
        self.usual = usual  # the newest that was repeated

    def head(self, at: int) -> tuple[int, int, int]:
        """Opcode, length and channel (-1: not a message) of the record at @at."""
        if at + RECORD_HEAD_BYTES > len(self.data):
            raise FormError("a message is cut off")
        opcode, length = struct.unpack_from("<BQ", self.data, at)
        if length > len(self.data) - at - RECORD_HEAD_BYTES or not 0 < opcode <= OP_LAST:
            raise FormError("a malformed record in a chunk")
        if opcode != OP_MESSAGE:
            return opcode, length, -1
        if length < DATA_OFFSET - RECORD_HEAD_BYTES:
            raise FormError("a message is too short")
        return HEAD.unpack_from(self.data, at)

    def repetitions(self, at: int, pattern: Pattern) -> int:
        """How often @pattern follows itself from @at on."""
        stride = record_bytes(pattern)
        heads = heads_of(pattern)
        total = 0
        while (rows := min(ROWS_AT_ONCE, (len(self.data) - at) // stride)) > 0:
            same = np.ones(rows, bool)
            offset = at
            for length, first, last in heads:
                found = np.ndarray((rows,), "<u8", self.octets, offset, (stride,))
                same &= found == first
                place = offset + HEAD.size - LAST_BYTES
                found = np.ndarray((rows,), "<u4", self.octets, place, (stride,))
                same &= found == last
                offset += RECORD_HEAD_BYTES + length
            count = rows if same.all() else int(same.argmin())
            total += count
            at += count * stride
            if count < rows:
                break
        return total

    def find_pattern(self, at: int) -> Pattern:
        """The messages from @at up to where the first one comes again, or just one."""
        first = self.head(at)
        found = [first]
        channels = {first[2]}
        most = max(PATTERN_RECORDS_LEAST, 2 * len(self.usual)) if self.usual else PATTERN_RECORDS
        at += RECORD_HEAD_BYTES + first[1]
        while first[2] >= 0 and at < len(self.data) and len(found) < most:
            head = self.head(at)
            if head == first:
                return tuple(found)
            if head[2] < 0 or head[2] in channels:  # twice: its messages would change their order
                break
            channels.add(head[2])
            found.append(head)
            at += RECORD_HEAD_BYTES + head[1]
        return (first,)

    def block(self, at: int, stride: int, count: int, length: int, channel: int) -> Block:
        size = length - (DATA_OFFSET - RECORD_HEAD_BYTES)
        return Block(channel, Rows(self.octets, at + DATA_OFFSET, stride, count, size))

    def blocks(self) -> Iterator[Block]:
        """All messages; those of one channel are in their order."""
        at = 0
        while at < len(self.data):
            pattern = self.usual
            count = self.repetitions(at, pattern) if pattern else 0
            if count == 0:
                pattern = self.find_pattern(at)
                count = 1 if pattern[0][2] < 0 else self.repetitions(at, pattern)
                if count > 1:
                    self.usual = pattern
            stride = record_bytes(pattern)
            start = at
            for _, length, channel in pattern:
                if channel >= 0:
                    yield self.block(start, stride, count, length, channel)
                start += RECORD_HEAD_BYTES + length
            at += stride * count
