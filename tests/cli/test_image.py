# SPDX-License-Identifier: MIT
"""The process image as bytes (ecdaq data) and as a C header (ecdaq cstruct)."""

from __future__ import annotations

import re
import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from ecdaq import FAILED, Fake, fails, json_of, works

OUT_BYTES, IN_BYTES, SLAVES = 9, 13, 2
OUTPUTS, INPUTS = SLAVES * OUT_BYTES, SLAVES * IN_BYTES


def value_of(shown: dict[str, Any], offset: int, length: int) -> int:
    """An integer at a byte of the image."""
    for area in shown["area"]:
        data = bytes.fromhex(area["bytes"])
        at = offset - area["offset"]
        if at >= 0 and at + length <= len(data):
            return int.from_bytes(data[at : at + length], "little")
    raise AssertionError(offset)


def test_the_bytes_are_those_of_the_newest_cycle(daemon: Fake) -> None:
    works(daemon("set", "piccolo0.led=1", "piccolo0.oneshot_time=0x1122334455667788"))
    daemon.sample(daemon.next_cycle(), "piccolo0.led")
    with daemon.held():
        shown = json_of(daemon("data", "--json"))
        newest = json_of(daemon("status", "--json"))["cycle_number"]
    assert shown["cycle"] == newest
    assert (shown["output_bytes"], shown["image_bytes"]) == (OUTPUTS, OUTPUTS + INPUTS)
    assert [(a["direction"], a["offset"], a["length"]) for a in shown["area"]] == [
        ("output", 0, OUTPUTS),
        ("input", OUTPUTS, INPUTS),
    ]
    assert value_of(shown, 0, 1) == 1
    assert value_of(shown, 1, 8) == 0x1122334455667788
    if shown["flags"] == "":
        assert value_of(shown, OUTPUTS + 4, 8) == shown["dc_time_ns"]


def test_a_slave_is_shown_with_what_its_channels_cover(daemon: Fake) -> None:
    shown = json_of(daemon("data", "piccolo1", "--json"))["area"]
    assert [(a["name"], a["direction"], a["offset"], a["length"]) for a in shown] == [
        ("piccolo1", "output", OUT_BYTES, OUT_BYTES),
        ("piccolo1", "input", OUTPUTS + IN_BYTES, IN_BYTES),
    ]
    lines = works(daemon("data", "1", "0", "--inputs")).splitlines()
    assert re.fullmatch(r"cycle \d+(  .*)?", lines[0])
    assert lines[1] == "piccolo1 inputs: 13 bytes"
    assert re.fullmatch(r"0x001f  ([0-9a-f]{2} ){12}[0-9a-f]{2}", lines[2])
    assert lines[3] == "piccolo0 inputs: 13 bytes"
    assert lines[4].startswith("0x0012  ") and len(lines) == 5
    fails(daemon("data", "nobody"), FAILED, "nobody: no slave of this name")


def test_the_bytes_go_to_a_file(daemon: Fake, tmp_path: Path) -> None:
    file = tmp_path / "image.bin"
    assert works(daemon("data", "-o", str(file))) == ""
    assert len(file.read_bytes()) == OUTPUTS + INPUTS
    works(daemon("set", "piccolo0.led=1", "piccolo0.oneshot_time=1"))
    works(daemon("data", "0", "--outputs", "--output", str(file)))
    assert file.read_bytes() == bytes([1, 1, 0, 0, 0, 0, 0, 0, 0])
    fails(daemon("data", "-o", "/nowhere/x"), FAILED, "/nowhere/x: No such file")


def test_the_last_image_is_shown_after_the_end_of_ecdaqd(daemon: Fake) -> None:
    daemon.end()
    first, second = works(daemon("data")), works(daemon("data"))
    assert first == second and first.startswith("cycle ")


PROBE = """
#include <stdio.h>
#include <string.h>
#include "image.h"
/* The first bit of the member and how many there are, from the beginning of @at. */
static void show(const char *name, const void *at, unsigned bytes)
{
	const unsigned char *p = at;
	int first = -1, bits = 0;
	for (unsigned i = 0; i < bytes * 8; i++) {
		if (p[i / 8] >> i % 8 & 1) {
			first = first < 0 ? (int)i : first;
			bits++;
		}
	}
	printf("%s %d %d\\n", name, first, bits);
}
#define SHOW(type, member) do { \\
	union { struct type s; unsigned char b[sizeof(struct type)]; } u; \\
	memset(&u, 0, sizeof(u)); \\
	u.s.member = (__typeof__(u.s.member + 0))~0ull; \\
	show(#type "." #member, u.b, sizeof(u.b)); \\
} while (0)
int main(void)
{
@SHOWS@	return 0;
}
"""


def layout_of(header: str, folder: Path, compiler: str) -> dict[str, tuple[int, int]]:
    """First bit and number of bits of each member that is an integer, by a program that sets it."""
    (folder / "image.h").write_text(header)
    shows = ""
    for body in re.finditer(r"struct (\w+) \{\n(.*?)\n\} __attribute__", header, re.S):
        for member in re.finditer(r"^\tu?int\d+_t (\w+)(?: : \d+)?;", body[2], re.M):
            shows += f"\tSHOW({body[1]}, {member[1]});\n"
    (folder / "probe.c").write_text(PROBE.replace("@SHOWS@", shows))
    words = [compiler, "-Wall", "-Wextra", "-Wno-overflow", "-o", "probe", "probe.c"]
    subprocess.run(words, cwd=folder, check=True)
    text = subprocess.run([folder / "probe"], check=True, capture_output=True, text=True).stdout
    return {
        name: (int(first), int(bits)) for name, first, bits in map(str.split, text.splitlines())
    }


COMPILERS = [c for c in ("gcc", "clang", "cc") if shutil.which(c)]


@pytest.mark.parametrize("compiler", COMPILERS or [None])
@pytest.mark.parametrize("setting", ["BITS=0", "BITS=1"])
def test_the_compiler_puts_each_member_where_the_channel_is(
    fake: Callable[..., Fake], tmp_path: Path, compiler: str | None, setting: str
) -> None:
    if compiler is None:
        pytest.skip("no C compiler here")
    daemon = fake(setting)
    header = works(daemon("cstruct", "--name", "bus"))
    found = layout_of(header, tmp_path, compiler)
    expected = {}
    for channel in json_of(daemon("channels", "--json")):
        is_output = channel["direction"] == "output"
        if channel["type"].startswith("FLOAT"):
            continue  # below
        member = re.sub(r"[^A-Za-z0-9]", "_", channel["name"])
        if channel["name"] in ("piccolo0.a b", "piccolo0.a-b"):
            member += f"__at_{channel['bit_offset']}"
        at = channel["bit_offset"] - (0 if is_output else OUTPUTS * 8)
        expected[f"bus_{'outputs' if is_output else 'inputs'}.{member}"] = (
            at,
            channel["bit_length"],
        )
    if setting == "BITS=1":
        assert "\t/* piccolo1_status lies over it: 8 bits at 35.3 */\n" in header
        assert "\tdouble piccolo0_sample_time; /* 22.0 FLOAT64 */\n" in header
        del expected["bus_inputs.piccolo1_status"]
    pads = {name: bits for name, bits in found.items() if re.search(r"\.pad\d+$", name)}
    assert {name: bits for name, bits in found.items() if name not in pads} == expected


@pytest.mark.parametrize(
    "compiler", [c for c in ("g++", "clang++", "c++") if shutil.which(c)] or [None]
)
def test_the_header_is_cpp_too(daemon: Fake, tmp_path: Path, compiler: str | None) -> None:
    if compiler is None:
        pytest.skip("no C++ compiler here")
    works(daemon("cstruct", "--output", str(tmp_path / "image.h")))
    (tmp_path / "a.cpp").write_text('#include "image.h"\n#include "image.h"\necdaq_inputs a;\n')
    subprocess.run([compiler, "-Wall", "-Werror", "-c", "a.cpp"], cwd=tmp_path, check=True)


def test_units_and_scales_are_in_the_comments(daemon: Fake) -> None:
    header = works(daemon("cstruct"))
    assert "\tuint16_t piccolo0_adc; /* 18.0 UINT16 * 0.000805664062 + 0 V */\n" in header
    assert "\tuint32_t piccolo0_led : 1; /* 0.0 BOOL */\n\tuint32_t pad0 : 7;\n" in header
    assert "/* bytes 18 to 43 of the image */\nstruct ecdaq_inputs {\n" in header


def test_a_header_that_cannot_be_written_is_reported(daemon: Fake, tmp_path: Path) -> None:
    fails(daemon("cstruct", "-o", "/nowhere/x.h"), FAILED, "/nowhere/x.h: No such file")
    fails(daemon("cstruct", "-o", "/dev/full"), FAILED, "/dev/full: No space left on device")
