# SPDX-License-Identifier: MIT
"""Every recipe is read by BitBake's own parser and keeps the rules."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import firmware
import pytest
import rules
from conftest import MACHINES, TOP
from execute import copy_tree
from graph import Graph, Task
from metadata import Metadata, MetadataError, Recipe

OURS = {
    "linux-ecdaq",
    "soem",
    "ecdaq",
    "ecdaq-config",
    "ecdaq-segment",
    "ecdaq-image",
    "u-boot-ecdaq",
}
TEXTS = sorted(
    p
    for folder in ("recipes", "layers", "kernel-config", "app/tools/image")
    for p in (TOP / folder).rglob("*")
    if p.is_file() and p.suffix not in (".pyc",)
)


def check_all(metadata: Metadata, rule: Callable[[Recipe], list[str]]) -> None:
    breaches = [line for recipe in metadata.recipes.values() for line in rule(recipe)]
    ours = [line for line in breaches if "sdk-chroot" not in line]
    assert not ours, "\n".join(ours)


def test_every_recipe_of_the_tree_is_parsed(metadata: Metadata) -> None:
    files = {p.resolve() for p in (TOP / "recipes").rglob("*.bb")}
    parsed = {r.file.resolve() for r in metadata.recipes.values()}
    assert files <= parsed
    assert set(metadata.recipes) >= OURS


def test_licences_are_named_and_known(metadata: Metadata) -> None:
    check_all(metadata, rules.license_fields)


def test_licence_texts_are_those_that_were_checked(metadata: Metadata) -> None:
    check_all(metadata, lambda recipe: rules.license_texts(recipe, TOP))


def test_sources_from_outside_are_pinned(metadata: Metadata) -> None:
    check_all(metadata, rules.pins)


def test_boot_files_are_where_wic_looks(metadata: Metadata) -> None:
    image = metadata.recipes["ecdaq-image"]
    assert image.value("IMAGE_BOOT_FILES")
    assert rules.boot_files(image) == []


def test_the_boot_partition_of_a_board_has_what_its_config_txt_needs(metadata: Metadata) -> None:
    files = dict(
        entry.split(";") if ";" in entry else (entry, entry)
        for entry in metadata.recipes["ecdaq-image"].value("IMAGE_BOOT_FILES").split()
    )
    config = next((source for source, name in files.items() if name == "config.txt"), None)
    if config is None:
        pytest.skip("QEMU's machine has no firmware")
    text = (TOP / "recipes/recipes-core/ecdaq-rpi/files/config.txt").read_text()
    assert firmware.missing(text, set(files.values())) == []


def test_build_sh_and_the_image_build_the_same_soem(metadata: Metadata) -> None:
    soem = metadata.recipes["soem"]
    third_party = TOP / "app" / "third_party"
    assert rules.soem_pin(soem, third_party / "soem.lock") == []
    assert rules.soem_patches(soem, third_party / "patches") == []


def test_the_tasks_of_an_image_have_an_order(metadata: Metadata) -> None:
    graph = Graph(metadata)
    hashes = {graph.hash(Task("ecdaq-image", name)) for name in ("do_rootfs", "do_image")}
    assert len(hashes) == 2


def test_what_does_not_depend_on_the_machine_is_built_once(tmp_path: Path) -> None:
    """Packages have the same hash on both machines; only the image itself differs."""
    hashes = []
    for machine in MACHINES:
        settings = {"MACHINE": machine, "DISTRO": "ecdaq", "TMPDIR": str(tmp_path)}
        graph = Graph(Metadata(TOP, tmp_path / machine, settings))
        hashes.append(
            [
                graph.hash(Task(name, "do_dpkg_build"))
                for name in ("linux-ecdaq", "u-boot-ecdaq", "ecdaq")
            ]
        )
    assert all(h == hashes[0] for h in hashes)


@pytest.mark.parametrize("path", sorted((TOP / "recipes").rglob("*.bb")), ids=lambda p: p.stem)
def test_fields_are_in_order(path: Path) -> None:
    assert rules.field_order(path.name, path.read_text()) == []


def test_no_registry_is_named() -> None:
    found = [line for path in TEXTS for line in rules.no_hosts(str(path), path.read_text())]
    assert found == []


def test_an_error_in_a_recipe_is_reported_with_file_and_line(tmp_path: Path) -> None:
    top = tree_copy(tmp_path)
    broken = top / "recipes" / "recipes-app" / "ecdaq" / "ecdaq_0.1.0.bb"
    broken.write_text(broken.read_text() + "\nthis is no assignment\n")
    line = len(broken.read_text().splitlines())
    with pytest.raises(MetadataError) as caught:
        Metadata(top, tmp_path / "build", {"MACHINE": MACHINES[0], "DISTRO": "ecdaq"})
    assert f"{broken.name}:{line}" in str(caught.value)


@pytest.mark.parametrize(
    ("name", "old", "new"),
    [
        ("layers/meta-ecdaq/conf/machine/include/ecdaq-cmdline.inc", "panic=5", "panic=6"),
        ("recipes/recipes-core/ecdaq-image/ecdaq-image.bb", "ssh_host_*_key*", "ssh_host_*"),
        ("layers/meta-local/classes/image.bbclass", "head -n 1)", "tail -n 1)"),
    ],
    ids=["command line", "function of the recipe", "function of the class"],
)
def test_a_change_of_the_disk_contents_rebuilds_the_image(
    tmp_path: Path, name: str, old: str, new: str
) -> None:
    # Trees of their own: BitBake remembers files by their path.
    before, same, changed = (tree_copy(tmp_path / name) for name in ("before", "same", "changed"))
    text = (changed / name).read_text()
    assert old in text
    (changed / name).write_text(text.replace(old, new))
    assert image_hash(same) == image_hash(before)
    assert image_hash(changed) != image_hash(before)


def test_a_commit_that_changes_nothing_of_the_image_does_not_rebuild_it(tmp_path: Path) -> None:
    top = tree_copy(tmp_path)
    assert image_hash(top, ECDAQ_COMMIT="1111111") == image_hash(top, ECDAQ_COMMIT="2222222")


def test_an_image_names_the_commit_that_it_is_built_from(metadata: Metadata) -> None:
    image = metadata.recipes["ecdaq-image"]
    assert "name_image" in image.value("ROOTFS_POSTPROCESS_COMMAND").split()
    commit = image.value("ECDAQ_COMMIT")
    assert re.fullmatch(r"[0-9a-f]{7,40}(-dirty)?", commit), commit
    assert f"-{commit}" in image.value("name_image")


def image_hash(top: Path, **more: str) -> str:
    settings = {
        "MACHINE": "ecdaq-qemuarm64",
        "DISTRO": "ecdaq",
        "TMPDIR": "/tmp",
        "ECDAQ_TOP": str(TOP),
    }
    settings |= more
    return Graph(Metadata(top, top.parent / "build", settings)).hash(
        Task("ecdaq-image", "do_image")
    )


def tree_copy(folder: Path) -> Path:
    for name in ("layers", "recipes", "kernel-config"):
        copy_tree(TOP / name, folder / "tree" / name)
    return folder / "tree"
