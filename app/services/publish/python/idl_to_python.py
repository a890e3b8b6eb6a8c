#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Write ecdaq/idl_types.py from ecdaq.idl: idl_to_python.py IDL OUTPUT.

Run by the build (CMakeLists.txt) and by pip (setup.py). It reads the subset of IDL that ecdaq.idl
keeps to (ADR 30): one module of @final structs, whose members are primitives, strings and
sequences of those. Everything else is an error.
"""

from __future__ import annotations

import re
import sys
from pathlib import Path

TYPES = {
    "boolean": "bool",
    "double": "types.float64",
    "string": "str",
    "unsigned short": "types.uint16",
    "unsigned long": "types.uint32",
    "long": "types.int32",
    "unsigned long long": "types.uint64",
    "long long": "types.int64",
}
HEADER = '''\
# SPDX-License-Identifier: MIT
"""Generated from ecdaq.idl by idl_to_python.py: do not edit."""

# No "from __future__ import annotations": cyclonedds reads the annotations as they are.

from dataclasses import dataclass

from cyclonedds.idl import IdlStruct, types
from cyclonedds.idl.annotations import final, key
'''
TOPIC = re.compile(r'// Topic "([^"]+)"')
MODULE = re.compile(r"module (\w+) \{")
STRUCT = re.compile(r"@final struct (\w+) \{")
MEMBER = re.compile(r"(@key )?(?:sequence<([a-z ]+)>|([a-z ]+)) (\w+);")


def convert(idl: str) -> str:
    """The text of ecdaq/idl_types.py. ValueError names the line that is not in the subset."""
    output = [HEADER.rstrip()]
    topics: dict[str, str] = {}
    topic = module = struct = ""
    for number, source in enumerate(idl.splitlines(), 1):
        topic = found[1] if (found := TOPIC.search(source)) else topic
        line = source.partition("//")[0].strip()
        if not line:
            continue
        if found := MODULE.fullmatch(line):
            module = found[1]
        elif found := STRUCT.fullmatch(line):
            struct = found[1]
            topics[struct] = topic
            name = f'{struct}(IdlStruct, typename="{module}.{struct}")'
            output += ["", "", "@dataclass", "@final", f"class {name}:"]
        elif line == "};":
            struct = ""
        elif struct and (found := MEMBER.fullmatch(line)) and (found[2] or found[3]) in TYPES:
            kind = TYPES[found[2] or found[3]]
            output.append(f"    {found[4]}: " + (f"types.sequence[{kind}]" if found[2] else kind))
            output += [f'    key("{found[4]}")'] if found[1] else []
        else:
            raise ValueError(f"line {number}: not in the supported subset of IDL: {line}")
    lines = [f'    {struct}: "{name}",' for struct, name in topics.items()]
    return "\n".join([*output, "", "", "TOPICS = {", *lines, "}", ""])


def generate(idl: Path, output: Path) -> None:
    output.parent.mkdir(parents=True, exist_ok=True)
    output.write_text(convert(idl.read_text()))


if __name__ == "__main__":
    try:
        generate(Path(sys.argv[1]), Path(sys.argv[2]))
    except (OSError, ValueError) as error:
        sys.exit(f"idl_to_python.py: {sys.argv[1]}: {error}")
