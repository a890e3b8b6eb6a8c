# SPDX-License-Identifier: MIT
"""The installed library, headers and example are enough for a program of one's own."""

from __future__ import annotations

import os
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
STAGE = Path(os.environ.get("ECDAQ_STAGE", ROOT / "build" / "stage"))
SANITIZE = ["-fsanitize=address,undefined"] if os.environ.get("ECDAQ_FLAVOUR") == "asan" else []

# A ring with one 16-bit channel, scaled by a half, and three samples; the last is stale.
PRODUCER = r"""
#include <string.h>
#include "base/ring.h"
#include "base/sample.h"

struct meta { struct sample_meta head; struct slave_info slave; struct channel channel; };

int main(int argc, char **argv)
{
	struct meta meta = {
		.head = {
			.version = SAMPLE_VERSION,
			.slave_count = 1,
			.channel_count = 1,
			.image_bytes = 2,
			.period_ns = 1000000,
		},
		.channel = { .name = "a.adc", .type = CHANNEL_UINT, .bit_len = 16, .scale = 0.5 },
	};
	struct ring_spec spec = {
		.path = argv[argc - 1],
		.kind = "sample",
		.slot_count = 16,
		.payload_bytes = sizeof(struct sample_header) + 2,
		.meta = &meta,
		.meta_bytes = sizeof(meta),
		.file_mode = 0640,
	};
	struct ring *ring;

	if (ring_create(&spec, &ring) < 0)
		return 1;
	for (unsigned char i = 0; i < 3; i++) {
		struct sample_header header = { .cycle = 7u + i, .dc_time_ns = 1000 + i,
						.flags = i == 2 ? SAMPLE_LOST : 0 };
		unsigned char image[2] = { i, 0 };

		ring_push(ring, &header, sizeof(header), image, sizeof(image));
	}
	ring_destroy(ring);
	return 0;
}
"""


def compile_against_library(source: Path, program: Path, *flags: str) -> None:
    (pc,) = STAGE.rglob("ecdaq.pc")
    found = subprocess.run(
        ["pkg-config", "--cflags", "--libs", str(pc)], check=True, capture_output=True, text=True
    ).stdout.split()
    cc = ["gcc", "-std=c11", "-Wall", "-Wextra", "-Werror", *SANITIZE, *flags]
    # Where it stands, the library is on no search path; installed to /usr it is.
    rpath = f"-Wl,-rpath,{pc.parents[1]}"
    subprocess.run([*cc, str(source), "-o", str(program), *found, rpath], check=True)


@pytest.fixture(scope="module")
def example(tmp_path_factory: pytest.TempPathFactory) -> Path:
    program = tmp_path_factory.mktemp("example") / "read_ring"
    source = STAGE / "share" / "ecdaq" / "examples" / "read_ring.c"
    compile_against_library(source, program, "-D_GNU_SOURCE")
    return program


@pytest.fixture(scope="module")
def ring(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    folder = tmp_path_factory.mktemp("ring")
    (folder / "producer.c").write_text(PRODUCER)
    compile_against_library(folder / "producer.c", folder / "producer")
    path = Path("/dev/shm") / f"ecdaq-test-{os.getpid()}"
    subprocess.run([folder / "producer", path], check=True)
    yield path
    path.unlink()


def read_ring(example: Path, *arguments: str | Path) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [example, *arguments], capture_output=True, text=True, check=False, timeout=60
    )


def test_the_example_prints_what_the_ring_holds(example: Path, ring: Path) -> None:
    result = read_ring(example, ring, "a.adc")
    assert result.returncode == 0, result.stderr
    assert result.stdout.splitlines() == ["7 1000 0", "8 1001 0.5", "9 1002 1 bad"]


def test_the_example_names_a_channel_that_is_not_there(example: Path, ring: Path) -> None:
    result = read_ring(example, ring, "b.adc")
    assert result.returncode == 1
    assert result.stderr == "read_ring: b.adc: no such channel\n"


def test_the_example_refuses_what_is_no_ring(example: Path, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("no ring")
    result = read_ring(example, tmp_path / "file")
    assert result.returncode == 1
    assert "Protocol error" in result.stderr


def test_licences_and_the_way_to_soem_are_installed() -> None:
    share = STAGE / "share" / "ecdaq"
    for name in ("licenses/LICENSE", "licenses/GPL-2.0-only.txt", "licenses/SOEM.txt"):
        assert (share / name).stat().st_size > 1000
    assert "sha256 = " in (share / "soem" / "soem.lock").read_text()
    patches = {p.name for p in (ROOT / "app/third_party/patches").glob("*.patch")}
    assert {p.name for p in (share / "soem" / "patches").glob("*.patch")} == patches
