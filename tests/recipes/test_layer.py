# SPDX-License-Identifier: MIT
"""layers/meta-ecdaq is a layer for others: what OE-core's yocto-check-layer asks of one, as far as
BitBake's library shows without Isar."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
import rules
from conftest import MACHINES, TOP
from graph import Graph, Task
from metadata import LAYERS, Metadata
from test_recipes import tree_copy

LAYER = TOP / "layers" / "meta-ecdaq"
CONFIGURATIONS = sorted(LAYER.rglob("*.conf"))
PATCHES = sorted([*TOP.glob("recipes/**/*.patch"), *TOP.glob("app/third_party/patches/*.patch")])
# A layer of someone else, with all that a build needs: a machine, a distribution and a package.
OTHER = {
    "conf/layer.conf": """\
BBPATH .= ":${LAYERDIR}"
BBFILES += "${LAYERDIR}/recipes-other/*/*.bb"
BBFILE_COLLECTIONS += "other"
BBFILE_PATTERN_other = "^${LAYERDIR}/"
BBFILE_PRIORITY_other = "6"
LAYERVERSION_other = "1"
LAYERDEPENDS_other = "core"
LAYERSERIES_COMPAT_other = "v0.6"
""",
    "conf/machine/theirs.conf": 'DISTRO_ARCH = "arm64"\n',
    "conf/distro/theirs.conf": """\
require conf/distro/debian-trixie.conf
DISTRO_VERSION = "1"
MAINTAINER = "Someone <someone@example.org>"
""",
    "recipes-other/tool/tool_1.0.bb": """\
SUMMARY = "A tool"
LICENSE = "MIT"
inherit dpkg-raw
do_install() {
	install -d "${D}/usr/bin"
}
""",
}


@pytest.fixture
def other(tmp_path: Path) -> Path:
    for name, text in OTHER.items():
        path = tmp_path / "meta-other" / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    return tmp_path / "meta-other"


def task_hashes(top: Path, other: Path, *layers: str) -> dict[Task, str]:
    """Every task of meta-other's recipe and of the core's, for their own machine."""
    settings = {"MACHINE": "theirs", "DISTRO": "theirs", "TMPDIR": "/tmp"}
    build = other.parent / f"build-{len(layers)}-{top.parent.name}"
    metadata = Metadata(top, build, settings, [*layers, str(other)])
    graph = Graph(metadata)
    return {
        task: graph.hash(task)
        for recipe in ("tool", "sdk-chroot")
        for task in (Task(recipe, name) for name in metadata.recipes[recipe].tasks)
    }


def test_the_layer_changes_no_task_of_others(other: Path) -> None:
    without = task_hashes(TOP, other, LAYERS[0])
    assert {task.name for task in without} >= {"do_dpkg_build", "do_bootstrap"}
    assert task_hashes(TOP, other, *LAYERS) == without


def test_a_layer_that_changes_others_is_found(other: Path, tmp_path: Path) -> None:
    top = tree_copy(tmp_path)
    conf = top / "layers" / "meta-ecdaq" / "conf" / "layer.conf"
    conf.write_text(conf.read_text() + 'DEBIAN_SECTION = "net"\n')
    assert task_hashes(top, other, *LAYERS) != task_hashes(top, other, LAYERS[0])


def test_layer_conf_is_complete(metadata: Metadata) -> None:
    assert rules.collections(metadata.configuration) == []


def test_every_recipe_belongs_to_one_layer(metadata: Metadata) -> None:
    found = {n: rules.owners(metadata.configuration, r.file) for n, r in metadata.recipes.items()}
    assert found == {n: ["core" if n == "sdk-chroot" else "ecdaq"] for n in metadata.recipes}


def test_only_fetching_uses_the_network(metadata: Metadata) -> None:
    recipes = [r for r in metadata.recipes.values() if r.name != "sdk-chroot"]
    assert [line for recipe in recipes for line in rules.networking_tasks(recipe)] == []
    assert any(recipe.flag("do_fetch", "network") for recipe in recipes)


@pytest.mark.parametrize("path", CONFIGURATIONS, ids=lambda p: p.stem)
def test_the_layer_chooses_neither_machine_nor_distribution(path: Path) -> None:
    assert rules.choices(str(path), path.read_text()) == []


@pytest.mark.parametrize("path", PATCHES, ids=lambda p: p.stem)
def test_every_patch_says_where_it_is_upstream(path: Path) -> None:
    assert rules.patch_status(path.name, path.read_text()) == []


def test_no_file_has_the_name_of_one_of_another_layer() -> None:
    """BitBake takes the first of BBPATH: qemuarm64 and raspberrypi4-64 are Isar's, OE-core's and
    meta-raspberrypi's."""
    found = [p for d in ("conf/machine", "conf/distro", "wic") for p in (LAYER / d).rglob("*.*")]
    assert len(found) >= 6
    assert [p.name for p in found if not p.name.startswith("ecdaq")] == []


def test_the_layer_says_who_maintains_it_and_on_what_terms() -> None:
    readme = (LAYER / "README.md").read_text()
    for word in ("maintainer", "patch", "security.md", "dependencies"):
        assert word in readme.lower(), word
    address = re.findall(r"\S+@\S+", readme)
    distro = (LAYER / "conf/distro/ecdaq.conf").read_text()
    assert any(a.strip("`,()<>") in distro for a in address)
    assert all(f"`{machine}`" in readme for machine in MACHINES)
    assert (LAYER / "LICENSE").read_bytes() == (TOP / "LICENSE").read_bytes()
    assert "vulnerability" in (LAYER / "SECURITY.md").read_text()


def test_both_kas_files_name_machines_and_layers_that_exist() -> None:
    for path in (TOP / "layers/kas").glob("*.yml"):
        text = path.read_text()
        machine = re.search(r"^machine: (\S+)$", text, re.MULTILINE)
        assert machine and machine[1] in MACHINES, path
    text = (TOP / "layers/kas/ecdaq.yml").read_text()
    assert re.search(r"^    commit: [0-9a-f]{40}$", text, re.MULTILINE)
    assert (TOP / "layers/meta-ecdaq").is_dir() and "layers/meta-ecdaq:" in text
