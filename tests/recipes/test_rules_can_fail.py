# SPDX-License-Identifier: MIT
"""Each rule is shown a breach, and has to find it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import firmware
import pytest
import rules
import wks
from kconfig import differences
from metadata import Recipe


class Data:
    """A datastore with a few variables."""

    def __init__(self, **values: str) -> None:
        self.values = values

    def getVar(self, name: str) -> Any:  # noqa: N802 - BitBake's name
        return self.values.get(name)


def recipe(**values: str) -> Recipe:
    good = {
        "SUMMARY": "s",
        "DESCRIPTION": "d",
        "SECTION": "net",
        "LICENSE": "MIT",
        "LIC_FILES_CHKSUM": "file://LICENSE;md5=0",
    }
    return Recipe("x", Path("x.bb"), Data(**(good | values)))


def test_a_good_recipe_has_no_breach() -> None:
    assert rules.license_fields(recipe()) == []


@pytest.mark.parametrize(
    "values", [{"LICENSE": "Beer"}, {"LICENSE": ""}, {"SUMMARY": ""}, {"LIC_FILES_CHKSUM": ""}]
)
def test_a_missing_or_unknown_licence_is_found(values: dict[str, str]) -> None:
    assert rules.license_fields(recipe(**values)) != []


def test_a_changed_licence_text_is_found(tmp_path: Path) -> None:
    (tmp_path / "LICENSE").write_text("other")
    assert rules.license_texts(recipe(), tmp_path) != []


@pytest.mark.parametrize(
    "values",
    [{"SRC_URI": "https://x/y.tar.gz"}, {"PYPI_PACKAGE": "p", "PYPI_SHA256": "abc"}],
)
def test_an_unpinned_source_is_found(values: dict[str, str]) -> None:
    assert rules.pins(recipe(**values)) != []


def test_another_soem_is_found(tmp_path: Path) -> None:
    lock = tmp_path / "soem.lock"
    lock.write_text("package = p\nversion = 1\nsha256 = aa\n")
    same = recipe(PYPI_PACKAGE="p", PYPI_VERSION="1", PYPI_SHA256="aa")
    assert rules.soem_pin(same, lock) == []
    assert (
        len(rules.soem_pin(recipe(PYPI_PACKAGE="p", PYPI_VERSION="2", PYPI_SHA256="b"), lock)) == 2
    )


def test_a_forgotten_patch_is_found(tmp_path: Path) -> None:
    (tmp_path / "0001-a.patch").write_text("")
    assert rules.soem_patches(recipe(SRC_URI=""), tmp_path) != []
    assert rules.soem_patches(recipe(SRC_URI="file://0001-a.patch"), tmp_path) == []


@pytest.mark.parametrize(
    "text", ['LICENSE = "MIT"\nSUMMARY = "x"\n', "SUMMARY='x'\n", 'SUMMARY="x"\n']
)
def test_disorder_in_a_recipe_is_found(text: str) -> None:
    assert rules.field_order("x.bb", text) != []


def test_a_registry_by_name_is_found() -> None:
    host = "deb." + "debian.org"
    assert rules.no_hosts("x", f"deb http://{host}/debian trixie main\n") != []


@pytest.mark.parametrize("text", ['MACHINE ?= "y"\n', 'A = "1"\nDISTRO = "y"\n'])
def test_a_layer_that_chooses_is_found(text: str) -> None:
    assert rules.choices("x.conf", 'MACHINE_FEATURES = ""\n') == []
    assert rules.choices("x.conf", text) != []


LAYER = {
    "BBFILE_COLLECTIONS": "core x",
    "LAYERSERIES_CORENAMES": "v1 next",
    **{f"BBFILE_PATTERN_{n}": f"^/{n}/" for n in ("core", "x")},
    **{f"BBFILE_PRIORITY_{n}": "5" for n in ("core", "x")},
    **{f"LAYERVERSION_{n}": "1" for n in ("core", "x")},
    **{f"LAYERSERIES_COMPAT_{n}": "v1" for n in ("core", "x")},
    "LAYERDEPENDS_x": "core",
}


@pytest.mark.parametrize(
    "values",
    [
        {"BBFILE_PATTERN_x": ""},
        {"BBFILE_PRIORITY_x": "high"},
        {"LAYERVERSION_x": ""},
        {"LAYERSERIES_COMPAT_x": ""},
        {"LAYERSERIES_COMPAT_x": "v0"},
        {"LAYERDEPENDS_x": ""},
        {"LAYERDEPENDS_x": "core y"},
    ],
)
def test_an_incomplete_layer_is_found(values: dict[str, str]) -> None:
    assert rules.collections(Data(**LAYER)) == []
    assert len(rules.collections(Data(**(LAYER | values)))) >= 1


def test_a_recipe_of_no_layer_is_found() -> None:
    assert rules.owners(Data(**LAYER), Path("/x/recipes/a.bb")) == ["x"]
    assert rules.owners(Data(**LAYER), Path("/x/../recipes/a.bb")) == []


def test_a_foreign_source_without_a_homepage_is_found() -> None:
    assert rules.license_fields(recipe(SRC_URI="apt://linux")) != []
    assert rules.license_fields(recipe(SRC_URI="apt://linux", HOMEPAGE="https://x/")) == []


def test_a_build_that_uses_the_network_is_found() -> None:
    class Flags(Data):
        def getVarFlag(self, task: str, _name: str, _expand: bool) -> Any:  # noqa: N802
            return self.values.get(task)

    tasks: dict[str, list[str]] = {"do_fetch": [], "do_dpkg_build": []}
    good = Recipe("x", Path("x.bb"), Flags(do_fetch="1"), tasks)
    bad = Recipe("x", Path("x.bb"), Flags(do_dpkg_build="1"), tasks)
    assert rules.networking_tasks(good) == []
    assert rules.networking_tasks(bad) == ["x.bb: do_dpkg_build uses the network"]


@pytest.mark.parametrize("text", ["Fix it.\n", "Upstream-Status: Unknown\n"])
def test_a_patch_without_a_status_is_found(text: str) -> None:
    assert rules.patch_status("a.patch", "Upstream-Status: Inappropriate [x]\n") == []
    assert rules.patch_status("a.patch", text) != []


@pytest.mark.parametrize(
    ("config", "fragment", "breaches"),
    [
        ("CONFIG_A=y\n", "CONFIG_A=y\n", 0),
        ("CONFIG_A=m\n", "CONFIG_A=y\n", 1),
        ("# CONFIG_A is not set\n", "CONFIG_A=y\n", 1),
        ("", "CONFIG_A=y\n", 1),
        ("", "CONFIG_A=n\n", 0),
        ("CONFIG_A=y\n", "CONFIG_A=n\n", 1),
        ('CONFIG_A="x"\n', 'CONFIG_A="y"\n', 1),
    ],
)
def test_a_symbol_that_did_not_arrive_is_found(
    tmp_path: Path, config: str, fragment: str, breaches: int
) -> None:
    (tmp_path / "config").write_text(config)
    (tmp_path / "a.cfg").write_text(fragment)
    assert len(differences(tmp_path / "config", [tmp_path / "a.cfg"])) == breaches


def test_two_fragments_that_contradict_are_found(tmp_path: Path) -> None:
    (tmp_path / "config").write_text("CONFIG_A=y\n")
    (tmp_path / "a.cfg").write_text("CONFIG_A=y\n")
    (tmp_path / "b.cfg").write_text("CONFIG_A=m\n")
    assert differences(tmp_path / "config", [tmp_path / "a.cfg", tmp_path / "b.cfg"]) != []


def test_a_fragment_line_without_a_symbol_is_an_error(tmp_path: Path) -> None:
    (tmp_path / "a.cfg").write_text("CONFIG-A=y\n")
    with pytest.raises(ValueError, match=r"a\.cfg:1"):
        differences(tmp_path / "a.cfg", [])


@pytest.mark.parametrize(
    "entry", ["usr/lib/firmware/start.elf;start.elf", "/w/rootfsx/a;a", "../a;a"]
)
def test_a_boot_file_that_wic_would_not_find_is_found(entry: str) -> None:
    good = "vmlinux;Image /w/rootfs/usr/a;a name.dtb"
    assert rules.boot_files(recipe(IMAGE_ROOTFS="/w/rootfs", IMAGE_BOOT_FILES=good)) == []
    assert rules.boot_files(recipe(IMAGE_ROOTFS="/w/rootfs", IMAGE_BOOT_FILES=entry)) != []


GOOD = """\
bootloader --ptable gpt
part --source bootimg-partition --fstype=vfat --label boot --fixed-size 8M
part / --source rootfs --fstype=ext4 --label root --fixed-size 16M
"""


def test_a_layout_is_read(tmp_path: Path) -> None:
    (tmp_path / "a.wks").write_text(GOOD)
    layout = wks.parse(tmp_path / "a.wks")
    assert layout.table == "gpt"
    assert [p.size_bytes for p in layout.partitions] == [8 << 20, 16 << 20]
    assert layout.find("rootfs").label == "root"


@pytest.mark.parametrize(
    "line",
    [
        "part / --source rootfs --fstype=ext4 --label again --fixed-size 1M",
        "part --label x",
        "part /data --label x --fixed-size 1M",
        "part --label x --fixed-size much",
        "part --label x --fixed-size 1M --fstype=ntfs",
        "partition 'open",
        "something else",
    ],
)
def test_an_error_in_a_layout_is_reported_with_line_or_file(tmp_path: Path, line: str) -> None:
    (tmp_path / "a.wks").write_text(GOOD + line + "\n")
    with pytest.raises(wks.WksError, match=r"a\.wks"):
        wks.parse(tmp_path / "a.wks")


@pytest.mark.parametrize(
    ("text", "name"),
    [
        ("gpu_mem=16\n", "start4cd.elf"),
        ("gpu_mem_1024 = 31\n", "fixup4cd.dat"),
        ("start_x=1\n", "start4x.elf"),
        ("[cm4]\ndtoverlay=i2c-rtc,pcf85063a\n", "overlays/i2c-rtc.dtbo"),
        ("device_tree=own.dtb\n", "own.dtb"),
        ("kernel=kernel9.img # ours\n", "kernel9.img"),
        ("initramfs initrd.img followkernel\nramfsfile=initrd.img\n", "initrd.img"),
    ],
)
def test_a_file_that_the_firmware_does_not_find_is_named(text: str, name: str) -> None:
    present = {"start4.elf", "fixup4.dat", "config.txt", *firmware.TREES}
    assert firmware.missing("gpu_mem=32\n", present) == []
    assert name in firmware.missing(text, present)
    assert name not in firmware.missing(text, present | {name})


def test_a_board_without_its_device_tree_is_named() -> None:
    present = {"start4.elf", "fixup4.dat", "config.txt", *firmware.TREES[1:]}
    assert firmware.missing("", present) == [firmware.TREES[0]]


def test_a_key_that_the_firmware_does_not_know_is_named() -> None:
    image = b"\x7fELF\0gpu_mem_256\0upstream_kernel\0"
    text = "upstream_kernel=1\nkernel_watchdog_timeout=60\ngpu_mem=64\n"
    assert firmware.unknown_keys(text, image) == ["kernel_watchdog_timeout"]
