# SPDX-License-Identifier: MIT
"""The installed library and headers are enough for a program of one's own."""

from __future__ import annotations

import os
import subprocess
import tempfile
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
BUILD = Path(os.environ.get("ECDAQ_BUILD", ROOT / "build" / "release"))
STAGE = Path(os.environ.get("ECDAQ_STAGE", ROOT / "build" / "stage"))
SANITIZE = ["-fsanitize=address,undefined"] if os.environ.get("ECDAQ_FLAVOUR") == "asan" else []

EXAMPLES = STAGE / "share" / "ecdaq" / "examples" / "reader"
PRODUCER = BUILD / "tests" / "cli" / "test_ring_producer"


def flags(*words: str) -> list[str]:
    (pc,) = STAGE.rglob("ecdaq.pc")
    found = subprocess.run(
        ["pkg-config", *words, str(pc)], check=True, capture_output=True, text=True
    )
    # In the build folder the library is on no search path; installed to /usr it is.
    return [*found.stdout.split(), f"-Wl,-rpath,{pc.parents[1]}"]


def compiled(source: Path, program: Path, *words: str) -> Path:
    compiler = ["g++", "-std=c++17"] if source.suffix == ".cpp" else ["gcc", "-std=c11"]
    strict = ["-Wall", "-Wextra", "-Wpedantic", "-Werror", *SANITIZE]
    libraries = flags("--cflags", "--libs", *words)
    subprocess.run([*compiler, *strict, str(source), "-o", str(program), *libraries], check=True)
    return program


def run(*words: str | Path) -> subprocess.CompletedProcess[str]:
    return subprocess.run(words, capture_output=True, text=True, check=False, timeout=60)


@pytest.fixture(scope="module")
def run_dir() -> Iterator[Path]:
    """What a master leaves behind that measured 300 cycles, without the cycles 100 to 106."""
    with tempfile.TemporaryDirectory(dir="/dev/shm") as name:
        arguments = ["--cycles", "300", "--skip", "100:7", "--events", "3"]
        subprocess.run([PRODUCER, name, *arguments], check=True, capture_output=True)
        yield Path(name)


@pytest.fixture(scope="module")
def samples(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return compiled(EXAMPLES / "samples.c", tmp_path_factory.mktemp("c") / "samples")


def test_the_c_example_prints_every_sample_of_a_channel(samples: Path, run_dir: Path) -> None:
    result = run(samples, "piccolo0.counter", run_dir)
    assert result.returncode == 0, result.stderr
    lines = [line.split() for line in result.stdout.splitlines()]
    cycles = [int(line[0]) for line in lines]
    assert cycles == [*range(100), *range(107, 300)]
    assert len({line[2] for line in lines}) > 250, "a counter counts"
    utc_ns = [int(line[1]) for line in lines]
    assert all(0 < after - before < 20_000_000 for before, after in pairwise(utc_ns))


def test_the_c_example_fails_for_a_channel_that_is_not_there(samples: Path, run_dir: Path) -> None:
    result = run(samples, "piccolo0.nope", run_dir)
    assert result.returncode == 1
    assert result.stdout == ""


def test_the_cpp_example_prints_events(tmp_path: Path, run_dir: Path) -> None:
    program = compiled(EXAMPLES / "events.cpp", tmp_path / "events")
    result = run(program, run_dir)
    assert result.returncode == 0, result.stderr
    assert len(result.stdout.splitlines()) == 3
    assert "set by" in result.stdout
    assert result.stderr == "0 events were lost\n"


def test_the_static_library_is_enough(tmp_path: Path, run_dir: Path) -> None:
    (archive,) = STAGE.rglob("libecdaq.a")
    program = tmp_path / "samples"
    include = ["-I", str(STAGE / "include")]
    source = str(EXAMPLES / "samples.c")
    command = ["gcc", "-std=c11", *SANITIZE, *include, source, "-o", str(program), str(archive)]
    subprocess.run([*command, "-lm"], check=True)
    assert run(program, "piccolo0.counter", run_dir).returncode == 0


def test_find_package_builds_the_examples(tmp_path: Path, run_dir: Path) -> None:
    sanitize = " ".join(SANITIZE)
    configure = ["cmake", "-S", EXAMPLES, "-B", tmp_path, f"-DCMAKE_PREFIX_PATH={STAGE}"]
    configure += [f"-DCMAKE_C_FLAGS={sanitize}", f"-DCMAKE_CXX_FLAGS={sanitize}"]
    subprocess.run(configure, check=True, capture_output=True)
    subprocess.run(["cmake", "--build", tmp_path], check=True, capture_output=True)
    assert run(tmp_path / "samples", "piccolo1.adc", run_dir).returncode == 0


@pytest.mark.parametrize("library", ["libecdaq.a", "libecdaq.so"])
def test_every_symbol_of_the_library_has_its_prefix(library: str) -> None:
    (file,) = STAGE.rglob(library)
    kind = ["--dynamic"] if library.endswith(".so") else []
    listed = subprocess.run(
        ["nm", *kind, "--defined-only", "--extern-only", "--format=posix", file],
        check=True,
        capture_output=True,
        text=True,
    ).stdout
    names = [line.split()[0] for line in listed.splitlines() if len(line.split()) > 1]
    assert "ecdaq_reader_open" in names
    assert [name for name in names if not name.startswith("ecdaq_")] == []


def test_the_installed_headers_are_c_and_cpp(tmp_path: Path) -> None:
    headers = sorted((STAGE / "include").rglob("*.h"))
    assert [h.name for h in headers] == ["control.h", "reader.h"]
    text = "".join(f"#include <ecdaq/{h.name}>\n" for h in headers)
    for name, compiler in (("a.c", "gcc"), ("a.cpp", "g++")):
        (tmp_path / name).write_text(text)
        command = [compiler, "-Wall", "-Wextra", "-Wpedantic", "-Werror", "-fsyntax-only"]
        subprocess.run([*command, "-I", STAGE / "include", tmp_path / name], check=True)


def test_licences_and_the_way_to_soem_are_installed() -> None:
    share = STAGE / "share" / "ecdaq"
    for name in ("licenses/LICENSE", "licenses/GPL-2.0-only.txt", "licenses/SOEM.txt"):
        assert (share / name).stat().st_size > 1000
    assert "sha256 = " in (share / "soem" / "soem.lock").read_text()
    patches = {p.name for p in (ROOT / "app/third_party/patches").glob("*.patch")}
    assert {p.name for p in (share / "soem" / "patches").glob("*.patch")} == patches
