# SPDX-License-Identifier: MIT
"""Inputs of fuzz targets that are made rather than kept: `make(target, folder)` writes them.

They stand beside tests/fuzz/TARGET/corpus/, which holds what is easier kept as a file.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from pathlib import Path

# As in bring_up.c and changes.h.
CHOICES = 12
FRAME, MAIL, EEPROM_REGISTERS, AL_STATUS = range(4)
WITH_IDENTIFICATION, WITH_EEPROM = 4, 8
EL3104, AKD = 1, 3
LOST = 0

Change = tuple[int, int, int]  # answers that pass before it, byte of the answer, XOR


def bus(slave: int, options: int, *changes: Change) -> bytes:
    head = bytes([slave + CHOICES * options, len(changes)])
    return head + b"".join(
        bytes([passed]) + at.to_bytes(2, "little") + bytes([xor]) for passed, at, xor in changes
    )


def bring_up() -> Iterator[tuple[str, bytes]]:
    yield "no-slave", bus(EL3104, FRAME, *[(0, 0, LOST)] * 255)
    # Byte 8 of a mail is the SDO command: an answer of 1, 2 or 4 bytes becomes an abort. Bytes 12
    # and 13 are the value: a number of entries, a PDO, or an entry that is another one.
    for slave, name, answers in ((EL3104, "el3104", 24), (AKD, "akd", 20)):
        for n in range(answers):
            for size, xor in ((1, 0xCF), (2, 0xCB), (4, 0xC3)):
                yield f"abort-{name}-{n}-{size}", bus(slave, MAIL, (n, 8, xor))
            yield f"value-{name}-{n}", bus(slave, MAIL, (n, 12, 0x80), (0, 13, 0x80))
            yield f"no-answer-{name}-{n}", bus(slave, MAIL, *[(n, 0, LOST)] * 3)
        yield f"alias-{name}", bus(slave, WITH_EEPROM)
    # Bytes 2 and 3 of an answer that begins at 0x0500, 0 and 1 of one at 0x0502: the interface
    # is the controller's, is busy, refuses, has a wrong checksum, or is not loaded.
    for n in (0, 1, 3, 8, 60, 200):
        for at, xor in ((0, 1), (1, 0x80), (1, 0x20), (1, 0x40), (1, 0x08), (1, 0x10), (2, 1)):
            yield (
                f"eeprom-{n}-{at}-{xor}",
                bus(EL3104, EEPROM_REGISTERS + WITH_EEPROM, *[(n, at, xor)] + [(0, at, xor)] * 6),
            )
        yield (
            f"eeprom-{n}-lost",
            bus(EL3104, EEPROM_REGISTERS + WITH_EEPROM, *[(n, 0, LOST)] * 20),
        )
    # Bit 5 of the AL status: its code is the identification; bit 4: an error.
    for n in range(4):
        for name, xor in (("given", 0x20), ("error", 0x30)):
            yield f"id-{name}-{n}", bus(EL3104, WITH_IDENTIFICATION + AL_STATUS, (n, 0, xor))
        yield (
            f"id-lost-{n}",
            bus(EL3104, WITH_IDENTIFICATION + AL_STATUS, *[(n, 0, LOST)] * 9),
        )


def coe() -> Iterator[tuple[str, bytes]]:
    """Uploads of 4 bytes whose answer is refused, lost and repeated, or lost for good."""
    upload = bytes([0, 0, 20, 0, 1, 0])
    for flags in (2, 4, 6, 12):  # the first write is refused; a mail is said to be there
        yield f"begin-{flags}", upload[:3] + bytes([flags]) + upload[4:]
    answer = bytes([0x00, 0x30, 0x43, 0x00, 0x60, 0x01, 1, 2, 3, 4])
    for name, control in (("refused", 0x10), ("lost", 0x20), ("both", 0x30)):
        mail = bytes([3 | control, len(answer)]) + answer
        yield f"answer-{name}", upload + mail * 6
        yield f"waited-{name}", upload[:5] + bytes([255]) + mail * 6
        yield f"answer-{name}-once", upload + mail + bytes([3, len(answer)]) + answer


ENI_ELEMENT = re.compile(r"<(\w+)>([^<]+)</\1>")


def eni() -> Iterator[tuple[str, bytes]]:
    """A plan, and behind a zero byte one that has each element otherwise, or not at all; and plans
    that have something that is none."""
    corpus = Path(__file__).resolve().parent / "eni" / "corpus"
    plans = {
        name: (corpus / name).read_text("latin-1") for name in ("two-slaves", "piccolos", "foreign")
    }
    for one, text in plans.items():
        for other, second in plans.items():
            yield f"pair-{one}-{other}", f"{text}\0{second}".encode("latin-1")
    text = plans["two-slaves"]
    for n, found in enumerate(ENI_ELEMENT.finditer(text)):
        start, end = found.span(2)
        value = found.group(2)
        others = {"digit": value[:-1] + ("2" if value[-1] != "2" else "3"), "text": "zz"}
        for name, other in others.items():
            yield f"{name}-{n}", f"{text}\0{text[:start]}{other}{text[end:]}".encode("latin-1")
        yield f"none-{n}", f"{text}\0{text[: found.start()]}{text[found.end() :]}".encode("latin-1")
        if value.lstrip("-").isdigit():
            for bad in ("#x", "99999999999999999999", "-1", "#x1zz"):
                yield f"bad-{n}-{bad[:2]}", f"{text[:start]}{bad}{text[end:]}".encode("latin-1")
    deep = "".join(f"<a{n}>" for n in range(40))
    for name, bad in (
        *(("deep", f"<EtherCATConfig>{deep}"), ("open", text[: len(text) // 2])),
        *(("odd", text.replace("<Data>", "<Data>0")), ("none", "<a/>"), ("empty", "")),
        *(("long", text.replace("<Data>", "<Data>" + "00" * 9000)), ("latin", "<a>\xe4</a>")),
        ("token", f'<EtherCATConfig x="{"y" * (1 << 20)}"/>'),
    ):
        yield f"xml-{name}", bad.encode("latin-1")


SEEDS: dict[str, Callable[[], Iterator[tuple[str, bytes]]]] = {
    "bring_up": bring_up,
    "coe": coe,
    "eni": eni,
}


def make(target: str, folder: Path) -> list[Path]:
    """The files of @target, written to @folder."""
    if target not in SEEDS:
        return []
    folder.mkdir(parents=True, exist_ok=True)
    made = []
    for name, content in SEEDS[target]():
        made.append(folder / name)
        made[-1].write_bytes(content)
    return made
