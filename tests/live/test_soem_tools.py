# SPDX-License-Identifier: MIT
"""EEPROM, PDOs and object dictionary of simulated slaves, as SOEM's own tools read them."""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from segment import ROOT, Segment, wait_for

SLAVES = ["ek1100", "el2828", "el2889", "el3104"]
WITH_COE = 3
LOCK = ROOT / "app" / "third_party" / "soem.lock"


def archive() -> Path:
    """The source distribution that the build has fetched."""
    (name,) = re.findall(r"^file = (.+)$", LOCK.read_text(), re.MULTILINE)
    cache = Path(os.environ.get("XDG_CACHE_HOME", Path.home() / ".cache"))
    path = Path(os.environ.get("ECDAQ_SOEM_ARCHIVE", cache / "ecdaq" / name))
    if not path.is_file():
        pytest.skip(f"no {path}: the build was given unpacked sources")
    return path


@pytest.fixture(scope="module")
def tools(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with slaveinfo and eepromtool, on SOEM's own drivers."""
    compiler = shutil.which("cc")
    if compiler is None:
        pytest.skip("no C compiler")
    folder = tmp_path_factory.mktemp("soem")
    subprocess.run(["tar", "-xzf", archive(), "-C", folder], check=True, timeout=60)
    (soem,) = folder.glob("*/soem")
    # The initialiser of the old API lacks two members of the structure, DCtO and DCl.
    main = soem / "soem" / "ethercatmain.c"
    text = main.read_text()
    assert text.count("    &ec_DCtime,") == 1
    main.write_text(text.replace("    &ec_DCtime,", "    0, 0, &ec_DCtime,"))
    common = [*soem.glob("soem/*.c"), *soem.glob("osal/linux/*.c"), *soem.glob("oshw/linux/*.c")]
    include = [f"-I{soem / at}" for at in ("soem", "osal", "osal/linux", "oshw/linux")]
    for tool in ("slaveinfo", "eepromtool"):
        subprocess.run(
            [
                *(compiler, "-w", "-O1", "-fno-strict-aliasing", "-D_GNU_SOURCE", *include),
                *(soem / "test" / "linux" / tool / f"{tool}.c", *common),
                *("-o", folder / tool, "-lpthread", "-lrt"),
            ],
            check=True,
            timeout=600,
        )
    return folder


def same(first: bytes, second: bytes) -> bytes:
    return first if first == second else b""


class Seen:
    """What the tools read, and an ecdaqd in PRE-OP after them."""

    def __init__(self, segment: Segment, tools: Path, folder: Path) -> None:
        self.segment = segment

        def info(option: str) -> str:
            got = segment.space.run(str(tools / "slaveinfo"), "ecat0", option, check=False)
            return got.stdout if f"{len(SLAVES)} slaves found" in got.stdout else ""

        # It takes one of its options at a time.
        self.mapping = wait_for("answer to slaveinfo -map", lambda: info("-map"), 60)
        self.objects = wait_for("answer to slaveinfo -sdo", lambda: info("-sdo"), 60)
        self.eeprom = []
        for number in range(1, len(SLAVES) + 1):
            file = folder / f"{number}.soem"

            def read(number: int = number, file: Path = file) -> bytes:
                tool = (str(tools / "eepromtool"), "ecat0", str(number), "-r", str(file))
                segment.space.run(*tool)
                return file.read_bytes()

            # Words whose answer was lost are zeros for it, and no error: twice the same is right.
            self.eeprom.append(wait_for("two equal images", lambda r=read: same(r(), r()), 120))
        segment.start_daemon()
        wait_for("PREOP", lambda: segment.status().get("state") == "PREOP", 120)

    def show(self, *words: str) -> list[Any]:
        """The JSON values that ecdaq prints, one a line."""
        got = self.segment.ecdaq(*words, "--json", check=False)
        assert (got.returncode, got.stderr) == (0, "")
        return [json.loads(line) for line in got.stdout.splitlines()]


def of_slave(printed: str, pos: int) -> str:
    """What slaveinfo has printed of it."""
    return re.split(r"^Slave:\d+$", printed, flags=re.MULTILINE)[pos + 1]


@pytest.fixture(scope="module")
def seen(tools: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Seen]:
    folder = tmp_path_factory.mktemp("tools")
    settings = {"bus.target": "preop"}
    try:
        segment = Segment(folder, slaves=",".join(SLAVES), settings=settings)
    except PermissionError as why:
        pytest.skip(f"not permitted: {why}")
    try:
        segment.start_sim()
        yield Seen(segment, tools, folder)
    finally:
        segment.close()


@pytest.mark.parametrize("pos", range(len(SLAVES)), ids=SLAVES)
def test_the_eeprom_is_the_one_that_eepromtool_reads(seen: Seen, pos: int, tmp_path: Path) -> None:
    seen.segment.ecdaq("sii", "read", str(pos), "--output", str(tmp_path / "ours.bin"))
    assert (tmp_path / "ours.bin").read_bytes() == seen.eeprom[pos] != b""


@pytest.mark.parametrize("pos", range(1, len(SLAVES)), ids=SLAVES[1:])
def test_the_mapping_is_the_one_that_slaveinfo_reads(seen: Seen, pos: int, tmp_path: Path) -> None:
    mapped = re.findall(r"\] 0x(\w{4}):0x(\w\w) 0x(\w\w)", of_slave(seen.mapping, pos))
    theirs = sorted(tuple(int(word, 16) for word in entry) for entry in mapped)
    seen.segment.ecdaq("xml", str(pos), "--output", str(tmp_path / "slave.xml"))
    ((device,),) = seen.show("esi", str(tmp_path / "slave.xml"))
    ours = sorted(
        (entry["index"], entry["subindex"], entry["bits"])
        for pdo in device["pdo"]
        for entry in pdo["entry"]
        if pdo["sm"] is not None
    )
    assert ours == theirs != []


def test_the_dictionary_is_the_one_that_slaveinfo_reads(seen: Seen) -> None:
    printed = of_slave(seen.objects, WITH_COE)
    found = re.findall(r'^0x(\w{4})\s+"(.*?)"\s+\[', printed, re.MULTILINE)
    theirs = [(int(index, 16), name) for index, name in found]
    ours = [(o["index"], o["name"]) for o in seen.show("sdo", "list", str(WITH_COE))]
    assert ours == theirs != []
