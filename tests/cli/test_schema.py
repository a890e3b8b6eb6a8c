# SPDX-License-Identifier: MIT
"""`ecdaq config schema` against what the programs themselves take."""

from __future__ import annotations

import json
import re
import subprocess
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import yaml
from ecdaq import ECDAQ, ROOT
from jsonschema import Draft7Validator

Schema = dict[str, Any]
SAMPLE = ROOT / "app/doc/reference/ecdaq.sample.yaml"
# Each is given to every option in turn, as it stands in the file.
VALUES = [
    "0", "1", "2", "7", "-1", "100000000000000000000", "0.5", "-0.5", "inf", "-inf", "nan",
    "0x10", "0xg", "0x", "1ms", "1.5ms", "20us", "1h", "2 ms", "1MiB", "1.5GB", "1parsec", "50%",
    "5%%", "2cycles", "2frames", "3ppm", "on", "off", "On", "OFF", "true", "FALSE", "yes", "no",
    "maybe", "auto", "Op", "safeop", "periodic", "oneshot", "UINT", "real", "piccolo0", "a b",
    "a-b_9", "a.b", "x" * 40, "y" * 300, "oldest", "loopback", "10.0.0.1", "'12'", "'1ms'", "'on'",
]  # fmt: skip


class Yaml12(yaml.SafeLoader):
    """As editors read it: on, off, yes and no are text; so are 0o17 and 1_000."""


Yaml12.yaml_implicit_resolvers = {
    first: [(tag, rule) for tag, rule in found if not tag.endswith((":bool", ":int", ":float"))]
    for first, found in yaml.SafeLoader.yaml_implicit_resolvers.items()
}
Yaml12.add_implicit_resolver(
    "tag:yaml.org,2002:bool", re.compile(r"^(true|True|TRUE|false|False|FALSE)$"), list("tTfF")
)
Yaml12.add_implicit_resolver(
    "tag:yaml.org,2002:int", re.compile(r"^([-+]?[0-9]+|0x[0-9a-fA-F]+)$"), list("-+0123456789")
)
Yaml12.add_implicit_resolver(
    "tag:yaml.org,2002:float",
    re.compile(r"^[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?$"),
    list("-+0123456789."),
)


def load(text: str) -> Any:
    return yaml.load(text, Loader=Yaml12)


@pytest.fixture(scope="module")
def schema() -> Schema:
    text = subprocess.run([ECDAQ, "config", "schema"], capture_output=True, check=True).stdout
    found = json.loads(text)
    Draft7Validator.check_schema(found)
    return found


def options(schema: Schema, path: str = "") -> Iterator[tuple[str, Schema]]:
    """Each option with its name in the table: "cycle.period", "slaves[].sdo[].index"."""
    for name, inside in schema["properties"].items():
        if inside.get("type") == "array":
            yield from options(inside["items"], f"{path}{name}[].")
        elif "properties" in inside:
            yield from options(inside, f"{path}{name}.")
        else:
            yield path + name, inside


def test_it_has_every_option_of_the_reference_page_and_no_others(schema: Schema) -> None:
    page = (ROOT / "app/doc/reference/options.md").read_text()
    assert [name for name, _ in options(schema)] and {name for name, _ in options(schema)} == set(
        re.findall(r"^\| `([^`]+)` \|", page, re.MULTILINE)
    )


@pytest.mark.parametrize("loader", [Yaml12, yaml.SafeLoader])
def test_the_sample_file_is_valid_also_with_its_examples(schema: Schema, loader: Any) -> None:
    text = SAMPLE.read_text()
    lists = re.sub(r"^#(?! )(?=(slaves|outputs):| )|^#(?= +(-|\w+:))", "", text, flags=re.MULTILINE)
    for one in (text, lists):
        document = yaml.load(one, Loader=loader)
        assert [(*e.path, e.message) for e in Draft7Validator(schema).iter_errors(document)] == []
    assert len(document["slaves"]) == 1 and document["slaves"][0]["sdo"] and document["outputs"]


@pytest.mark.parametrize("path", sorted((ROOT / "app/tools/image").glob("profile-*.yaml")))
def test_the_profiles_of_the_image_are_valid(schema: Schema, path: Path) -> None:
    errors = Draft7Validator(schema).iter_errors(load(path.read_text()))
    assert [e.message for e in errors] == []


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("cylce: {period: 1ms}", "cylce"),
        ("cycle: {perod: 1ms}", "perod"),
        ("cycle: [1ms]", "is not of type 'object'"),
        ("slaves: {name: a}", "is not of type 'array'"),
        ("slaves: [{nmae: a}]", "nmae"),
        ("slaves: [{sdo: [{index: 0x8000}]}]", "'value' is a required property"),
        ("slaves: [{sdo: [0x8000 1]}]", "does not match"),
        ("slaves: [{pdos: [{entries: gap 8}]}]", "'pdo' is a required property"),
        ("slaves: [{pdos: [[1]]}]", "is not of type"),
        ("slaves: [{name: a, outputs: [{chanel: led}]}]", "chanel"),
        ("slaves: [{name: a, outputs: [{max: 1}]}]", "'channel' is a required property"),
        ("slaves: [{sdo: [7]}]", "is not of type 'object', 'string'"),
    ],
)
def test_what_is_not_an_option_is_refused(schema: Schema, text: str, reason: str) -> None:
    assert any(reason in e.message for e in Draft7Validator(schema).iter_errors(load(text)))


@pytest.mark.parametrize(
    "line",
    [
        "PS 0x8000:01 UINT = 3  # comment",
        "0x8000 REAL=0.5",
        "os 0x1c12 complete OCTETS = 01 00",
        "IP 0x8000:0x1a string = a#b # c",
    ],
)
def test_a_start_up_sdo_of_one_line_is_valid_and_taken(
    schema: Schema, tmp_path: Path, line: str
) -> None:
    text = f'slaves:\n  - sdo:\n      - "{line}"\n'
    assert list(Draft7Validator(schema).iter_errors(load(text))) == []
    assert problems(tmp_path, text) == {}


def problems(folder: Path, text: str) -> dict[int, str]:
    """What `ecdaq config check` says, by line."""
    path = folder / "ecdaq.yaml"
    path.write_text(text)
    done = subprocess.run([ECDAQ, "config", "check", path], capture_output=True, text=True)
    lines = (done.stdout + done.stderr).splitlines()
    found = [re.search(r"ecdaq\.yaml:(\d+): (.*)", line) for line in lines]
    return {int(m[1]): m[2] for m in found if m}


def test_a_value_that_the_programs_take_is_valid_and_one_of_another_type_is_not(
    schema: Schema, tmp_path: Path
) -> None:
    """Every value for every option outside of lists. Only bounds with a unit, and options that do
    not fit each other, are beyond a schema."""
    names = [(name, inside) for name, inside in options(schema) if "[]" not in name]
    beyond = re.compile(r"out of range|not a whole number of (ns|bytes|us)|longer than|requires")
    refused = taken = 0
    for value in VALUES:
        text, of_line = "", {}
        section = ""
        for name, inside in names:
            head, _, last = name.partition(".")
            if head != section:
                section = head
                text += f"{head}:\n"
            text += f"  {last}: {value}\n"
            of_line[text.count("\n")] = (name, inside)
        said = problems(tmp_path, text)
        document = load(f"value: {value}")["value"]
        for line, (name, inside) in of_line.items():
            is_valid = Draft7Validator(inside).is_valid(document)
            reason = said.get(line, "")
            if re.search(r"expected|unknown unit", reason):
                if value == "0x10":  # 16 for YAML, which has no units
                    continue
                assert not is_valid, f"{name}: {value}: valid, but {reason}"
                refused += 1
            elif not reason:
                assert is_valid, f"{name}: {value}: not valid, but taken"
                taken += 1
            else:
                assert not is_valid or beyond.search(reason) or name in reason, (
                    name,
                    value,
                    reason,
                )
    assert refused > 1000 and taken > 1000
