# SPDX-License-Identifier: MIT
"""What a recorded sample costs, in instructions and in bytes: `./build.sh measure record`."""

from __future__ import annotations

import os
import struct
import subprocess
import sys
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import official_writer
import zstandard
from counting import count
from mcap.opcode import Opcode
from mcap.records import Chunk, MessageIndex
from mcap.stream_reader import StreamReader

SLAVES = (2, 16, 64)
CYCLES = 1000
FILE_CYCLES = 3000
# MCAP 1.0: record heads are 9 bytes.
MESSAGE_HEAD = 9 + 22
INDEX_HEAD = 9 + 2 + 4
INDEX_ENTRY = 16
CHUNK_HEAD = 9 + 40
PARTS = {
    "encode": ("layout_encode", "messages_encode_cycle"),
    "CRC-32": ("libdeflate_crc32",),
    "index": ("mcap_chunk_index_add", "mcap_chunk_index_finish"),
    "compress": ("ZSTD_compress2",),
}


def instructions(slaves: int) -> list[float]:
    """All, the parts and the rest, a cycle."""
    counted = count("record", slaves, CYCLES)
    parts = [
        sum(counted.inclusive.get(function, 0) for function in functions)
        for functions in PARTS.values()
    ]
    total = counted.instructions
    return [n / CYCLES for n in (total, *parts, total - sum(parts))]


def recorded(slaves: int) -> list[Chunk | MessageIndex]:
    """Chunks and message indexes of a file."""
    program = Path(os.environ["ECDAQ_BUILD"]) / "tests" / "cost" / "cost_record"
    with tempfile.TemporaryDirectory(prefix="ecdaq-cost-", dir="/dev/shm") as folder:
        subprocess.run(
            [program, folder, str(slaves), str(FILE_CYCLES)], check=True, capture_output=True
        )
        (path,) = Path(folder, "records").glob("*.mcap")
        with path.open("rb") as stream:
            records = StreamReader(stream, emit_chunks=True, record_size_limit=None).records
            return [r for r in records if isinstance(r, Chunk | MessageIndex)]


def file_bytes(records: list[Chunk | MessageIndex]) -> dict[str, float]:
    """What a cycle takes in a file, by kind, uncompressed and as it is there."""
    sums = dict.fromkeys(("heads", "payload", "content", "index", "rest"), 0.0)
    for record in records:
        if isinstance(record, Chunk):
            sums["content"] += len(record.data)
            sums["payload"] += record.uncompressed_size
            sums["rest"] += CHUNK_HEAD + len(record.compression)
        else:
            sums["index"] += INDEX_HEAD + INDEX_ENTRY * len(record.records)
            sums["heads"] += MESSAGE_HEAD * len(record.records)
    sums["payload"] -= sums["heads"]
    # The recorder settles for 2,000 cycles first.
    return {name: total / (FILE_CYCLES + 2000) for name, total in sums.items()}


def records_of(content: bytes) -> list[tuple[int, bytes]]:
    """Channel (-1: not a message) and bytes of each record of a chunk."""
    found = []
    at = 0
    while at < len(content):
        end = at + 9 + struct.unpack_from("<Q", content, at + 1)[0]
        is_message = content[at] == Opcode.MESSAGE
        channel = struct.unpack_from("<H", content, at + 9)[0] if is_message else -1
        found.append((channel, content[at:end]))
        at = end
    return found


def is_slave(channel: int) -> bool:
    """The first channels are /ecdaq/cycle (0), event, timemap, sync0."""
    return channel > 3


def without_cycle(records: list[tuple[int, bytes]]) -> bytes:
    return b"".join(record for channel, record in records if channel != 0)


def one_message(records: list[tuple[int, bytes]]) -> bytes:
    """The slaves' fields behind those of the cycle, without the head that each of them has."""
    head = MESSAGE_HEAD + 40
    return b"".join(record[head:] if is_slave(channel) else record for channel, record in records)


def as_it_is(records: list[tuple[int, bytes]]) -> bytes:
    return b"".join(record for _, record in records)


@dataclass(frozen=True)
class Form:
    """What the files could be."""

    name: str
    make: Callable[[list[tuple[int, bytes]]], bytes] = as_it_is
    # Of a channel: its messages are in the index.
    is_indexed: Callable[[int], bool] = lambda channel: channel >= 0
    level: int = 1
    chunks_together: int = 1


FORMS = (
    Form("as it is"),
    Form("zstd 9", level=9),
    Form("a chunk each second", chunks_together=10),
    Form("no index (Foxglove's reader refuses it)", is_indexed=lambda _: False),
    Form("no /ecdaq/cycle", without_cycle, lambda channel: channel > 0),
    Form("one message a cycle for all slaves", one_message, lambda channel: 0 <= channel < 4),
)


def row_of(form: Form, slaves: int, chunks: list[list[tuple[int, bytes]]]) -> list[str]:
    n = form.chunks_together
    compressor = zstandard.ZstdCompressor(level=form.level)
    cycles = sum(channel == 0 for chunk in chunks for channel, _ in chunk)
    made = [form.make(chunk) for chunk in chunks]
    together = [b"".join(made[i : i + n]) for i in range(0, len(made), n)]
    content = sum(len(compressor.compress(part)) for part in together) / cycles
    entries = sum(form.is_indexed(channel) for chunk in chunks for channel, _ in chunk) / cycles
    stored = content + INDEX_ENTRY * entries
    numbers = [f"{n:.1f}" for n in (content, INDEX_ENTRY * entries, stored / slaves)]
    return [str(slaves), form.name, *numbers]


def forms(slaves: int, records: list[Chunk | MessageIndex]) -> list[list[str]]:
    chunks = [
        zstandard.ZstdDecompressor().decompress(r.data, max_output_size=r.uncompressed_size)
        for r in records
        if isinstance(r, Chunk)
    ]
    parsed = [records_of(chunk) for chunk in chunks[1:41]]
    return [row_of(form, slaves, parsed) for form in FORMS]


def print_rows(head: list[str], rows: list[list[str]]) -> None:
    widths = [max(len(row[i]) for row in [head, *rows]) for i in range(len(head))]
    for row in [head, *rows]:
        print("  ".join(word.rjust(width) for word, width in zip(row, widths, strict=True)))


def main() -> None:
    print("FB1111-Piccolos (7 fields a message), 1 kHz, zstd 1, a chunk each 100 ms,")
    print("noise of two counts in each adc and of some us in the times of the cycle")
    print()
    print("user instructions a cycle (callgrind)")
    head = ["slaves", "all", *PARTS, "rest", "a slave sample"]
    rows = []
    for slaves in SLAVES:
        numbers = instructions(slaves)
        rows.append([str(slaves), *(f"{n:.0f}" for n in numbers), f"{numbers[0] / slaves:.0f}"])
    print_rows(head, rows)
    print()
    print("bytes a cycle: before compression the heads of messages and what is in them; in the")
    print("file the compressed chunks, the message indexes (16 a message), and heads of chunks")
    head = ["slaves", "heads", "messages", "compressed", "index", "chunk heads", "a slave sample"]
    files = {slaves: recorded(slaves) for slaves in SLAVES}
    rows = []
    for slaves, records in files.items():
        b = file_bytes(records)
        stored = b["content"] + b["index"] + b["rest"]
        numbers = [b[k] for k in ("heads", "payload", "content", "index", "rest")]
        rows.append([str(slaves), *(f"{n:.1f}" for n in (*numbers, stored / slaves))])
    print_rows(head, rows)
    print()
    print("bytes a cycle of the same data in other forms, none of which is written")
    head = ["slaves", "form", "compressed", "index", "a slave sample"]
    print_rows(head, [row for n, records in files.items() for row in forms(n, records)])
    print()
    print("a cycle beside the official MCAP writer for Rust (mcap 0.26), zstd 1, equal chunks; it")
    print(
        f"has the messages ready in memory. CPU: median of {official_writer.ROUNDS} rounds in turns"
    )
    print_rows(official_writer.HEAD, official_writer.table())


if __name__ == "__main__":
    sys.exit(main())
