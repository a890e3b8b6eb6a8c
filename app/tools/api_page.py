# SPDX-License-Identifier: MIT
"""Write the reference page of the installed headers to standard output: api_page.py HEADER...

The page holds nothing that is not in the headers: each one's opening comment, then its macros,
types and functions in their order, each with the comment before it.
"""

from __future__ import annotations

import re
import sys
from dataclasses import dataclass
from pathlib import Path

INSTALLED = {"core/reader/api.h": "ecdaq/reader.h", "master/control/control.h": "ecdaq/control.h"}


@dataclass(frozen=True)
class Item:
    """One declaration: its name, its text in the header, its comment as prose."""

    name: str
    code: str
    comment: str


def prose(comment: str) -> str:
    """The text of a C comment; indented lines become a code block."""
    lines = [re.sub(r"^\s*\*? ?", "", line, count=1) for line in comment.splitlines()]
    text: list[str] = []
    for line in lines:
        is_code = line.startswith("\t")
        was_code = bool(text) and text[-1].startswith("    ")
        if is_code and not was_code and text and text[-1]:
            text.append("")
        text.append("    " + line.expandtabs(8)[8:] if is_code else line.rstrip())
    return "\n".join(text).strip("\n")


def comment_body(text: str) -> str:
    return re.sub(r"^/\*+\s?|\s*\*/$", "", text.strip())


def name_of(code: str) -> str:
    patterns = (
        r"^#define (\w+)",
        r"^(?:extern|__attribute__).*\b(\w+);$",
        r"^((?:struct|enum) \w+) \{",
        r"^((?:struct|enum) \w+);",
        r"(\w+)\([^()]*(?:\([^()]*\)[^()]*)*\)(?:;|\s*\{|$)",
    )
    for pattern in patterns:
        match = re.search(pattern, code, re.DOTALL)
        if match:
            return match.group(1)
    raise ValueError(f"no name in: {code[:60]}")


def is_public(code: str) -> bool:
    return "ECDAQ_" in code or "ecdaq_" in code


def items(body: str) -> list[Item]:
    """The declarations of a header's body, each with the comment directly before it."""
    comment = r"(?P<comment>/\*(?:[^*]|\*(?!/))*\*/\n)?"
    define = r"#define [^\n]*(?:\\\n[^\n]*)*"
    block = r"(?:struct|enum) \w+ \{.*?\n\};"
    inline = r"static inline .*?\n\{.*?\n\}"
    declaration = r"(?:const |extern |struct |enum |int |u?int\d+_t |double |void )[^;{]*;"
    pattern = rf"^{comment}(?P<code>{define}|{block}|{inline}|{declaration})"
    found = []
    for match in re.finditer(pattern, body, re.MULTILINE | re.DOTALL):
        code = match.group("code")
        if code.startswith("static inline"):
            code = code[: code.index("\n{")] + ";"
        if is_public(code) and not re.match(r"#define ECDAQ_\w+_H$", code):
            found.append(
                Item(name_of(code), code, prose(comment_body(match.group("comment") or "")))
            )
    return found


def page(header: Path) -> str:
    text = header.read_text()
    installed = INSTALLED["/".join(header.parts[-3:])]
    opening = re.search(r"/\*\n(.*?)\*/\n#ifndef", text, re.DOTALL)
    assert opening, f"{header}: no opening comment"
    out = [f"## `<{installed}>`", "", prose(opening.group(1)), ""]
    for item in items(text[opening.end() :]):
        out += [f"### `{item.name}`", ""]
        out += [item.comment, ""] if item.comment else []
        out += ["```c", item.code, "```", ""]
    return "\n".join(out)


def main(arguments: list[str]) -> None:
    print("# The programming interface\n")
    print(
        "Generated from the installed headers by `app/tools/api_page.py`; a test compares.\n"
        "How to build with it: [write a reader](../how-to/write-a-reader.md).\n"
    )
    print("\n".join(page(Path(argument).resolve()) for argument in arguments), end="")


if __name__ == "__main__":
    main(sys.argv[1:])
