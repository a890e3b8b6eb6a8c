# SPDX-License-Identifier: MIT
"""MCAP files: what they contain and where, and the content of their chunks.

All that is used of a finished file is covered by a CRC: the summary by its own, the content of each
chunk by the chunk's. Of a file still being written, which has no summary, every chunk up to the
last complete one is used.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

from ecdaq.errors import MissingExtraError, RecordingError
from ecdaq.sources import PART, Source

MAGIC = b"\x89MCAP0\r\n"
HEAD = struct.Struct("<BQ")  # opcode, length of the content
FOOTER = struct.Struct("<QQI")
CHUNK = struct.Struct("<QQQI")  # start, end, uncompressed size, CRC
CHUNK_START = struct.Struct("<BQQQQ")  # with the record's head, up to the CRC
CHUNK_INDEX = struct.Struct("<QQQQI")
SIZES = struct.Struct("<QQ")
COUNT = struct.Struct("<HQ")  # channel, messages
STATISTICS = struct.Struct("<QHIIIIQQI")
TAIL_BYTES = HEAD.size + FOOTER.size + len(MAGIC)
OP_FOOTER, OP_SCHEMA, OP_CHANNEL, OP_CHUNK, OP_CHUNK_INDEX = 0x02, 0x03, 0x04, 0x06, 0x08
OP_STATISTICS, OP_METADATA, OP_METADATA_INDEX, OP_DATA_END, OP_LAST = 0x0B, 0x0C, 0x0D, 0x0F, 0x0F
LIMIT_CHUNK_BYTES = 1 << 28
# One read of chunks.
READ_BYTES = 1 << 20


Octets = bytes | memoryview
# Compressed bytes and the size that they have decompressed, to these.
Tool = Callable[[Octets, int], Octets]


class FormError(Exception):
    """A record that is not as the specification says."""


class Fields:
    """The fields of one record, in order. FormError where it ends too early."""

    def __init__(self, data: bytes) -> None:
        self.data = data
        self.at = 0

    def take(self, layout: struct.Struct) -> tuple[Any, ...]:
        if self.at + layout.size > len(self.data):
            raise FormError("a record is too short")
        found = layout.unpack_from(self.data, self.at)
        self.at += layout.size
        return found

    def octets(self, count: int) -> bytes:
        if self.at + count > len(self.data):
            raise FormError("a record is too short")
        self.at += count
        return self.data[self.at - count : self.at]

    def number(self, layout: struct.Struct) -> int:
        return self.take(layout)[0]

    def text(self) -> str:
        try:
            return self.octets(self.number(U32)).decode()
        except UnicodeDecodeError as error:
            raise FormError("a text is not UTF-8") from error

    def pairs(self) -> dict[str, str]:
        inner = Fields(self.octets(self.number(U32)))
        found = {}
        while inner.at < len(inner.data):
            name = inner.text()
            found[name] = inner.text()
        return found


U16, U32, U64 = struct.Struct("<H"), struct.Struct("<I"), struct.Struct("<Q")


@dataclass(frozen=True)
class Schema:
    name: str
    encoding: str
    text: str


@dataclass(frozen=True)
class Topic:
    """A channel of MCAP."""

    id: int
    schema: int
    name: str
    encoding: str
    metadata: dict[str, str]


@dataclass(frozen=True)
class Chunk:
    """Where a chunk is, and what its head says."""

    offset: int  # of the record
    length: int
    start_ns: int  # smallest and largest log time
    end_ns: int
    size: int  # uncompressed
    compression: str
    compressed: int

    @property
    def content_at(self) -> int:
        """Where the content begins in the record."""
        return HEAD.size + CHUNK.size + U32.size + len(self.compression) + U64.size

    @property
    def head(self) -> bytes:
        """The record before the content, without the CRC."""
        times = self.start_ns, self.end_ns, self.size
        name = self.compression.encode("ascii", "replace")
        return b"".join((
            CHUNK_START.pack(OP_CHUNK, self.length - HEAD.size, *times),
            U32.pack(len(name)), name, U64.pack(self.compressed),
        ))  # fmt: skip


@dataclass
class Contents:
    """What a file contains."""

    schemas: dict[int, Schema] = field(default_factory=dict)
    topics: dict[int, Topic] = field(default_factory=dict)
    chunk_records: list[bytes] = field(default_factory=list)  # of the summary's index
    chunks: list[Chunk] = field(default_factory=list)
    metadata: list[tuple[int, int, str]] = field(default_factory=list)  # offset, length, name
    counted: tuple[int, int, int, int] | None = None  # messages, chunks, first and last log time
    of_topic: dict[int, int] = field(default_factory=dict)  # messages, as far as it is stated

    def define(self, opcode: int, content: bytes, is_final: bool) -> None:
        """Take a schema or channel; one that is there already is replaced if @is_final."""
        fields = Fields(content)
        if opcode == OP_SCHEMA:
            number = fields.number(U16)
            name, encoding = fields.text(), fields.text()
            try:
                text = fields.octets(fields.number(U32)).decode()
            except UnicodeDecodeError as error:
                raise FormError(f"schema {name} is not UTF-8") from error
            if is_final or number not in self.schemas:
                self.schemas[number] = Schema(name, encoding, text)
        else:
            number, schema = fields.number(U16), fields.number(U16)
            topic = Topic(number, schema, fields.text(), fields.text(), fields.pairs())
            if is_final or number not in self.topics:
                self.topics[number] = topic


def parse_chunk_index(content: bytes) -> Chunk:
    try:
        start, end, offset, length, skipped = CHUNK_INDEX.unpack_from(content)
        at = CHUNK_INDEX.size + skipped + U64.size  # behind the message index offsets
        compression, at = chunk_compression(content, at)
        compressed, size = SIZES.unpack_from(content, at)
    except struct.error as error:
        raise FormError("an entry of the index of chunks is too short") from error
    return Chunk(offset, length, start, end, size, compression, compressed)


def parse_chunk_head(content: Octets, offset: int, length: int) -> tuple[Chunk, int, int]:
    """The chunk, the CRC of its content, and where that begins in the record's own content."""
    try:
        start, end, size, crc = CHUNK.unpack_from(content)
        compression, at = chunk_compression(content, CHUNK.size)
        (compressed,) = U64.unpack_from(content, at)
    except struct.error as error:
        raise FormError("a chunk is too short") from error
    return Chunk(offset, length, start, end, size, compression, compressed), crc, at + U64.size


def chunk_compression(content: Octets, at: int) -> tuple[str, int]:
    """The name of a compression at @at, and where it ends."""
    (length,) = U32.unpack_from(content, at)
    end = at + U32.size + length
    return bytes(content[at + U32.size : end]).decode("ascii", "replace"), end


def records(data: bytes, start: int = 0) -> Iterator[tuple[int, bytes]]:
    """Opcode and content of the records of which @data consists."""
    at = start
    while at < len(data):
        if at + HEAD.size > len(data):
            raise FormError("a record is cut off")
        opcode, length = HEAD.unpack_from(data, at)
        at += HEAD.size
        if length > len(data) - at:
            raise FormError("a record is cut off")
        yield opcode, data[at : at + length]
        at += length


def decompressor(compression: str) -> Tool:
    """A function of the compressed bytes and the size they must have. One for each thread."""
    if compression == "":
        return lambda data, _size: data
    if compression == "zstd":
        try:
            import zstandard
        except ImportError as error:
            raise MissingExtraError("zstandard", "zstd") from error
        tool = zstandard.ZstdDecompressor()

        def from_zstd(data: Octets, size: int) -> Octets:
            try:
                if zstandard.frame_content_size(data) not in (-1, size):
                    raise FormError("a chunk has another size than its head says")
                return tool.decompress(data, max_output_size=size)
            except zstandard.ZstdError as error:
                raise FormError(f"a chunk cannot be decompressed: {error}") from error

        return from_zstd
    if compression == "lz4":
        try:
            import lz4.frame
        except ImportError as error:
            raise MissingExtraError("lz4", "lz4") from error

        def from_lz4(data: Octets, size: int) -> Octets:
            try:
                return lz4.frame.LZ4FrameDecompressor().decompress(data, size + 1)
            except (RuntimeError, EOFError) as error:
                raise FormError(f"a chunk cannot be decompressed: {error}") from error

        return from_lz4
    raise FormError(f"compression {compression!r} is not supported")


class Room:
    """Memory for the content of chunks, used again and again: new memory costs more than what is
    done in it."""

    def __init__(self) -> None:
        self._octets = memoryview(bytearray())

    def of(self, count: int) -> memoryview:
        """@count bytes, until the next call."""
        if len(self._octets) < count:
            self._octets = memoryview(bytearray(count))
        return self._octets[:count]


class Window:
    """Small reads of a source from its beginning to its end, by few large ones."""

    def __init__(self, source: Source, size: int) -> None:
        self.source = source
        self.size = size
        self.start = 0
        self.data = b""

    def read(self, offset: int, count: int) -> bytes:
        at = offset - self.start
        if at < 0 or at + count > len(self.data):
            length = min(max(count, READ_BYTES), self.size - offset)
            self.start, self.data, at = offset, self.source.read(offset, length), 0
        return self.data[at : at + count]


class McapFile:
    """One file; nothing is read before it is needed. All errors are RecordingError."""

    def __init__(self, source: Source) -> None:
        self.source = source
        self.name = source.name

    def fail(self, reason: object) -> RecordingError:
        return RecordingError(self.name, f"damaged: {reason}: see `ecdaq log check`, `log recover`")

    @cached_property
    def _opened(self) -> tuple[Contents, bool]:
        """The contents, and whether the file has been finished."""
        size = self.source.size()
        if self.source.read(0, min(size, len(MAGIC))) != MAGIC:
            raise RecordingError(self.name, "not an MCAP file")
        try:
            tail = self.source.read(max(0, size - TAIL_BYTES), min(size, TAIL_BYTES))
            if len(tail) == TAIL_BYTES and tail.endswith(MAGIC):
                return self._read_summary(tail, size), True
            if not self.name.endswith(PART):
                raise RecordingError(
                    self.name,
                    f"no summary at its end: cut off, or being copied: repair it by `ecdaq log "
                    f"recover`, or name it NAME.mcap{PART} to read what is complete",
                )
            return self._scan(size), False
        except FormError as error:
            raise self.fail(error) from error

    @property
    def contents(self) -> Contents:
        return self._opened[0]

    @property
    def is_finished(self) -> bool:
        return self._opened[1]

    def _read_summary(self, tail: bytes, size: int) -> Contents:
        opcode, length = HEAD.unpack_from(tail)
        start, _, crc = FOOTER.unpack_from(tail, HEAD.size)
        end = size - TAIL_BYTES
        if (opcode, length) != (OP_FOOTER, FOOTER.size) or not len(MAGIC) <= start <= end:
            raise FormError("no summary")
        data = self.source.read(start, end - start)
        if zlib.crc32(tail[: HEAD.size + 16], zlib.crc32(data)) != crc:
            raise FormError("the CRC of the summary is wrong, or there is none")
        found = Contents()
        for opcode, content in records(data):
            if opcode in (OP_SCHEMA, OP_CHANNEL):
                found.define(opcode, content, is_final=True)
            elif opcode == OP_CHUNK_INDEX:
                found.chunk_records.append(content)
            elif opcode == OP_METADATA_INDEX:
                fields = Fields(content)
                offset, length = fields.number(U64), fields.number(U64)
                found.metadata.append((offset, length, fields.text()))
            elif opcode == OP_STATISTICS:
                fields = Fields(content)
                messages, _, _, _, _, chunks, first, last, length = fields.take(STATISTICS)
                found.counted = messages, chunks, first, last
                found.of_topic = dict(
                    COUNT.iter_unpack(fields.octets(length - length % COUNT.size))
                )
        if found.counted is None or found.counted[1] != len(found.chunk_records):
            raise FormError("the summary does not list all chunks")
        return found

    def _scan(self, size: int) -> Contents:
        """Go from record to record to the last complete one."""
        found = Contents()
        window = Window(self.source, size)
        at = len(MAGIC)
        while at + HEAD.size <= size:
            opcode, length = HEAD.unpack(window.read(at, HEAD.size))
            content = at + HEAD.size
            if not 0 < opcode <= OP_LAST:
                raise FormError(f"no record at byte {at}")
            if length > size - content or opcode in (OP_DATA_END, OP_FOOTER):
                break
            if opcode in (OP_SCHEMA, OP_CHANNEL):
                found.define(opcode, window.read(content, length), is_final=False)
            elif opcode == OP_METADATA:
                head = window.read(content, min(length, 256))
                found.metadata.append((at, HEAD.size + length, Fields(head).text()))
            elif opcode == OP_CHUNK:
                head = window.read(content, min(length, 256))
                chunk, _, skipped = parse_chunk_head(head, at, HEAD.size + length)
                if skipped + chunk.compressed != length:
                    raise FormError(f"the chunk at byte {at} has another size than its head says")
                found.chunks.append(chunk)
            at = content + length
        for chunk in found.chunks[:1]:  # what is repeated in a chunk is covered by its CRC
            data = bytes(self.read_chunk(chunk, self.source.read(chunk.offset, chunk.length)))
            for opcode, record in records(data):
                if opcode in (OP_SCHEMA, OP_CHANNEL):
                    found.define(opcode, record, is_final=True)
        return found

    @cached_property
    def chunks(self) -> list[Chunk]:
        """All chunks, in the order of the file."""
        contents = self.contents
        if not self.is_finished:
            return contents.chunks
        try:
            found = [parse_chunk_index(record) for record in contents.chunk_records]
        except FormError as error:
            raise self.fail(error) from error
        return sorted(found, key=lambda chunk: chunk.offset)

    def read_chunk(self, chunk: Chunk, record: Octets, tool: Tool | None = None) -> Octets:
        """The content of @chunk, whose @record has been read, decompressed and checked."""
        start = chunk.content_at
        head = bytes(record[:start])
        is_same = head[: CHUNK_START.size] + head[CHUNK_START.size + U32.size :] == chunk.head
        if not is_same or len(record) != start + chunk.compressed:
            raise FormError(f"no chunk at byte {chunk.offset} as the summary has it")
        (crc,) = U32.unpack_from(head, CHUNK_START.size)
        if chunk.size > LIMIT_CHUNK_BYTES:
            raise FormError(f"a chunk of {chunk.size} bytes, {LIMIT_CHUNK_BYTES} are the limit")
        tool = tool or decompressor(chunk.compression)
        data = tool(record[start : start + chunk.compressed], chunk.size)
        if len(data) != chunk.size or zlib.crc32(data) != crc:
            raise FormError(f"the CRC of the chunk at byte {chunk.offset} is wrong")
        return data

    def batches(self, chunks: list[Chunk]) -> Iterator[list[Chunk]]:
        """@chunks in groups that lie close together, each for one read()."""
        batch: list[Chunk] = []
        for chunk in chunks:
            far = batch and chunk.offset + chunk.length - batch[0].offset > READ_BYTES
            if far:
                yield batch
                batch = []
            batch.append(chunk)
        if batch:
            yield batch

    def read(self, batch: list[Chunk], room: Room) -> memoryview:
        """The content of the chunks of @batch, one after the other, in @room."""
        start = batch[0].offset
        end = batch[-1].offset + batch[-1].length
        data = memoryview(self.source.read(start, end - start))
        tools: dict[str, Tool] = {}
        try:
            found = room.of(sum(min(chunk.size, LIMIT_CHUNK_BYTES) for chunk in batch))
            at = 0
            for chunk in batch:
                if chunk.compression not in tools:
                    tools[chunk.compression] = decompressor(chunk.compression)
                record = data[chunk.offset - start :][: chunk.length]
                if len(record) < HEAD.size:
                    raise FormError(f"no chunk at byte {chunk.offset}")
                content = self.read_chunk(chunk, record, tools[chunk.compression])
                found[at : at + chunk.size] = content
                at += chunk.size
        except FormError as error:
            raise self.fail(error) from error
        return found

    def metadata(self, name: str) -> dict[str, str]:
        """The newest metadata record of this name; {} if there is none."""
        found = [m for m in self.contents.metadata if m[2] == name]
        if not found:
            return {}
        offset, length, _ = found[-1]
        if length > LIMIT_CHUNK_BYTES:
            raise self.fail(f"metadata of {length} bytes")
        try:
            for opcode, content in records(self.source.read(offset, length)):
                fields = Fields(content)
                if opcode == OP_METADATA and fields.text() == name:
                    return fields.pairs()
        except FormError as error:
            raise self.fail(error) from error
        raise self.fail(f"no metadata {name} at byte {offset}")
