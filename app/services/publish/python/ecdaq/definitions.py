# SPDX-License-Identifier: MIT
"""Where the fields of a CDR message are, from its ros2msg definition and one message.

In a message of fixed size every field has a fixed offset; strings and sequences are of fixed size
as long as their lengths are the same. So a layout is made from one message, with the lengths it
depends on, and holds for every message in which these are equal.
"""

from __future__ import annotations

import re
import struct
from dataclasses import dataclass, field, replace

import numpy as np

PRIMITIVES = {
    "bool": "?", "byte": "u1", "char": "u1", "int8": "i1", "uint8": "u1", "int16": "i2",
    "uint16": "u2", "int32": "i4", "uint32": "u4", "int64": "i8", "uint64": "u8", "float32": "f4",
    "float64": "f8",
}  # fmt: skip
# In every ROS 2, so that a definition may leave them out.
WELL_KNOWN = {
    "builtin_interfaces/Time": "int32 sec\nuint32 nanosec",
    "builtin_interfaces/Duration": "int32 sec\nuint32 nanosec",
    "std_msgs/Header": "builtin_interfaces/Time stamp\nstring frame_id",
}
# Representation: byte order and largest alignment (OMG DDS-XTypes 7.6.2.1.2).
ENCODINGS = {0: (">", 8), 1: ("<", 8), 6: (">", 4), 7: ("<", 4)}
HEADER_BYTES = 4
DEPTH = 8  # of definitions inside of definitions
FIELDS = 65536  # in one message
FIELD_LINE = re.compile(
    r"(?P<type>[A-Za-z][\w/]*)(?:<=\d+)?(?P<array>\[(?P<bound><=)?(?P<count>\d*)\])?\s+"
    r"(?P<name>[A-Za-z]\w*)(?P<constant>\s*=)?"
)


class DefinitionError(ValueError):
    """A definition, or a message that does not fit it."""


@dataclass(frozen=True)
class Member:
    """One line of a definition. @count: None: one value; -1: a sequence; else an array."""

    type: str
    name: str
    count: int | None


@dataclass(frozen=True)
class Leaf:
    """A primitive or string in a message. @count as in Member; offsets from the first byte."""

    name: str
    dtype: str  # of numpy, with byte order; "S": a string
    offset: int
    count: int | None


@dataclass(frozen=True)
class Rows:
    """Messages of @size bytes in @octets, the first at @start, the next @stride bytes further."""

    octets: np.ndarray
    start: int
    stride: int
    count: int
    size: int

    def view(self, dtype: str, offset: int, count: int | None = None) -> np.ndarray:
        """One value, or @count of them, of each message, in place."""
        at = self.start + offset
        if count is None:
            return np.ndarray((self.count,), dtype, self.octets, at, (self.stride,))
        strides = (self.stride, np.dtype(dtype).itemsize)
        return np.ndarray((self.count, count), dtype, self.octets, at, strides)

    def octets_of(self, row: int, offset: int = 0, count: int | None = None) -> bytes:
        """@count bytes of one message; without @count the whole of it."""
        at = self.start + row * self.stride + offset
        return self.octets[at : at + (self.size if count is None else count)].tobytes()

    def only(self, row: int) -> Rows:
        """One of the messages."""
        return replace(self, start=self.start + row * self.stride, count=1)


@dataclass
class Layout:
    """Where everything is in messages of @size bytes in which all @guards hold."""

    size: int
    leaves: dict[str, Leaf] = field(default_factory=dict)
    guards: list[tuple[int, str, int]] = field(default_factory=list)  # offset, dtype, value

    def fits(self, rows: Rows) -> np.ndarray:
        """Which of @rows have this layout."""
        found = np.ones(rows.count, bool)
        for offset, dtype, value in self.guards:
            found &= rows.view(dtype, offset) == value
        return found

    def column(self, rows: Rows, leaf: Leaf) -> np.ndarray:
        """The values of @leaf in @rows: numbers in place, an array of str, one row each."""
        if leaf.dtype == "S":
            length = max(0, (leaf.count or 0) - 1)  # without the NUL
            texts = [rows.octets_of(n, leaf.offset, length) for n in range(rows.count)]
            found = np.empty(rows.count, object)
            found[:] = [text.decode(errors="replace") for text in texts]
            return found
        dtype = "u1" if leaf.dtype == "?" else leaf.dtype
        values = rows.view(dtype, leaf.offset, leaf.count)
        return values != 0 if leaf.dtype == "?" else values


class Definition:
    """A parsed ros2msg definition."""

    def __init__(self, name: str, text: str) -> None:
        self.name = name
        head, *others = re.split(r"^={3,}\s*$", text, flags=re.MULTILINE)
        self._types = {kind: parse(lines) for kind, lines in WELL_KNOWN.items()}
        for other in others:
            first, _, lines = other.strip().partition("\n")
            if not first.startswith("MSG:"):
                raise DefinitionError(f"{name}: expected 'MSG: TYPE', found {first[:40]!r}")
            self._types[short(first[4:].strip())] = parse(lines)
        self.members = parse(head)

    def type_of(self, name: str) -> list[Member]:
        package = self.name.partition("/")[0]
        for candidate in (short(name), f"{package}/{name}"):
            if candidate in self._types:
                return self._types[candidate]
        raise DefinitionError(f"{self.name}: no definition of {name}")

    def layout(self, message: bytes) -> Layout:
        """The layout of @message and of those like it."""
        if len(message) < HEADER_BYTES:
            raise DefinitionError(f"{self.name}: a message of {len(message)} bytes")
        encoding = message[0] << 8 | message[1]
        if encoding not in ENCODINGS:
            raise DefinitionError(f"{self.name}: encapsulation {encoding:#06x} is not supported")
        walk = Walk(self, message, *ENCODINGS[encoding])
        walk.layout.guards.append((0, ">u2", encoding))
        walk.members(self.members, "", 0)
        if not 0 <= len(message) - walk.at < 8:
            raise DefinitionError(
                f"{self.name}: a message of {len(message)} bytes, by its definition {walk.at}"
            )
        return walk.layout


def short(name: str) -> str:
    """pkg/Type of pkg/msg/Type."""
    return name.replace("/msg/", "/")


def parse(text: str) -> list[Member]:
    """The fields of one definition, without constants."""
    found = []
    for line in text.splitlines():
        plain = line.partition("#")[0].strip()
        if not plain:
            continue
        match = FIELD_LINE.match(plain)
        if not match:
            raise DefinitionError(f"not a field: {plain[:60]!r}")
        if match["constant"]:
            continue
        count: int | None = None
        if match["array"]:
            is_sequence = match["bound"] or not match["count"]
            count = -1 if is_sequence else int(match["count"])
        found.append(Member(match["type"], match["name"], count))
    return found


class Walk:
    """Goes through one message and writes down where its values are."""

    def __init__(self, definition: Definition, message: bytes, order: str, align: int) -> None:
        self.definition = definition
        self.message = message
        self.order = order
        self.align = align
        self.at = HEADER_BYTES
        self.layout = Layout(len(message))

    def skip(self, size: int, count: int = 1) -> int:
        """Step over @count aligned values of @size bytes. Where the first is."""
        start = self.at + -(self.at - HEADER_BYTES) % min(size, self.align) if count else self.at
        if start + size * count > len(self.message):
            raise DefinitionError(
                f"{self.definition.name}: a message of {len(self.message)} bytes is too short"
            )
        self.at = start + size * count
        return start

    def length(self) -> int:
        """The length of a string or sequence, which the layout then depends on."""
        offset = self.skip(4)
        (value,) = struct.unpack_from(self.order + "I", self.message, offset)
        self.layout.guards.append((offset, self.order + "u4", value))
        return value

    def put(self, name: str, dtype: str, offset: int, count: int | None) -> None:
        if len(self.layout.leaves) >= FIELDS:
            raise DefinitionError(f"{self.definition.name}: more than {FIELDS} fields")
        self.layout.leaves[name] = Leaf(name, dtype, offset, count)

    def members(self, members: list[Member], prefix: str, depth: int) -> None:
        if depth > DEPTH:
            raise DefinitionError(f"{self.definition.name}: more than {DEPTH} nested definitions")
        for m in members:
            name = prefix + m.name
            count = self.length() if m.count == -1 else m.count
            if (code := PRIMITIVES.get(m.type)) is not None:
                dtype = self.order + code if code[-1] not in "?1" else code
                size = np.dtype(dtype).itemsize
                self.put(name, dtype, self.skip(size, 1 if count is None else count), count)
                continue
            if count is not None and count > len(self.message):
                raise DefinitionError(f"{self.definition.name}: {name} has {count} elements")
            for n in range(1 if count is None else count):
                self.one(m.type, name if count is None else f"{name}[{n}]", depth)

    def one(self, kind: str, name: str, depth: int) -> None:
        if kind == "string":
            count = self.length()
            self.put(name, "S", self.skip(1, count), count)
            return
        members = self.definition.type_of(kind)
        if not members:  # as rosidl does, so that none takes no room
            members = [Member("uint8", "structure_needs_at_least_one_member", None)]
        self.members(members, f"{name}.", depth + 1)
