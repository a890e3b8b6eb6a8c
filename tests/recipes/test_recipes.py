# SPDX-License-Identifier: MIT
"""Every recipe is read by BitBake's own parser and keeps the rules."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
import rules
from conftest import MACHINES, TOP
from graph import Graph, Task
from metadata import Metadata, MetadataError, Recipe

OURS = {"linux-ecdaq", "soem", "ecdaq", "ecdaq-config", "ecdaq-segment", "ecdaq-image"}
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


def test_both_roads_build_the_same_soem(metadata: Metadata) -> None:
    soem = metadata.recipes["soem"]
    third_party = TOP / "app" / "third_party"
    assert rules.soem_pin(soem, third_party / "soem.lock") == []
    assert rules.soem_patches(soem, third_party / "patches") == []


def test_the_tasks_of_an_image_have_an_order(metadata: Metadata) -> None:
    graph = Graph(metadata)
    hashes = {graph.hash(Task("ecdaq-image", name)) for name in ("do_rootfs", "do_image")}
    assert len(hashes) == 2


def test_what_the_machine_does_not_matter_for_is_made_once(tmp_path: Path) -> None:
    """Packages have the same hash on both machines; only the image itself differs."""
    hashes = []
    for machine in MACHINES:
        settings = {"MACHINE": machine, "DISTRO": "ecdaq", "TMPDIR": str(tmp_path)}
        graph = Graph(Metadata(TOP, tmp_path / machine, settings))
        hashes.append(
            [graph.hash(Task(name, "do_dpkg_build")) for name in ("linux-ecdaq", "ecdaq")]
        )
    assert all(h == hashes[0] for h in hashes)


@pytest.mark.parametrize("path", sorted((TOP / "recipes").rglob("*.bb")), ids=lambda p: p.stem)
def test_fields_stand_in_order(path: Path) -> None:
    assert rules.field_order(path.name, path.read_text()) == []


@pytest.mark.parametrize("path", sorted((TOP / "layers").glob("*/conf/layer.conf")), ids=str)
def test_layers_keep_the_rules(path: Path) -> None:
    assert rules.layer_conf(str(path), path.read_text()) == []


def test_no_registry_is_named() -> None:
    found = [line for path in TEXTS for line in rules.no_hosts(str(path), path.read_text())]
    assert found == []


def test_an_error_in_a_recipe_is_told_with_file_and_line(tmp_path: Path) -> None:
    top = tmp_path / "tree"
    for folder in ("layers", "recipes"):
        (top / folder).parent.mkdir(parents=True, exist_ok=True)
        copy_tree(TOP / folder, top / folder)
    broken = top / "recipes" / "recipes-app" / "ecdaq" / "ecdaq_0.1.0.bb"
    broken.write_text(broken.read_text() + "\nthis is no assignment\n")
    line = len(broken.read_text().splitlines())
    with pytest.raises(MetadataError) as caught:
        Metadata(top, tmp_path / "build", {"MACHINE": MACHINES[0], "DISTRO": "ecdaq"})
    assert f"{broken.name}:{line}" in str(caught.value)


def copy_tree(source: Path, target: Path) -> None:
    for path in source.rglob("*"):
        if path.is_file():
            place = target / path.relative_to(source)
            place.parent.mkdir(parents=True, exist_ok=True)
            place.write_bytes(path.read_bytes())
