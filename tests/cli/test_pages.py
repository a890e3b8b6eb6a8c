# SPDX-License-Identifier: MIT
"""Completion and manual pages have every verb and every option."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
from pathlib import Path

import pytest
from ecdaq import ECDAQ, FAILED, NO_DAEMON, STAGE, USAGE, Fake, ecdaq, fails, works
from test_usage import VERBS

# cmake --install has put ecdaq there.
SHARE = STAGE / "share"
OPTION = re.compile(r"^  (?:-\w, )?(--[a-z-]+)", re.MULTILINE)


def options_of(verb: str) -> set[str]:
    return set(OPTION.findall(works(ecdaq(None, verb, "--help")))) - {"--version"}


def complete(*words: str, run_dir: str = "/nonexistent") -> set[str]:
    """What bash offers for the last of @words."""
    script = (
        'source /dev/stdin <<<"$SCRIPT"; COMP_WORDS=("$@"); COMP_CWORD=$(($# - 1)); _ecdaq;'
        'printf "%s\\n" "${COMPREPLY[@]}"'
    )
    got = subprocess.run(
        ["bash", "-euc", script, "bash", str(ECDAQ), *words],
        env=os.environ | {"SCRIPT": works(ecdaq(None, "completion")), "ECDAQ_RUN_DIR": run_dir},
        capture_output=True,
        text=True,
        check=True,
    )
    assert got.stderr == ""
    return set(got.stdout.split())


def test_every_verb_is_completed() -> None:
    assert complete("") >= {*VERBS, "log", "security", "--help", "--run-dir"}
    assert complete("--run-dir", "/x", "sla") == {"slaves"}


@pytest.mark.parametrize("verb", VERBS)
def test_every_option_of_a_verb_is_completed(verb: str) -> None:
    assert complete(verb, "--") == {*options_of(verb), "--help", "--run-dir", "--config"}


def test_words_and_slaves_of_a_verb_are_completed(daemon: Fake) -> None:
    assert complete("sdo", "re") == {"read"}
    assert complete("config", "") >= {"show", "check", "diff"}
    assert complete("histogram", "ro") == {"round-trip"}
    assert complete("sdo", "read", "p", run_dir=str(daemon.run_dir)) == {"piccolo0", "piccolo1"}
    assert complete("sdo", "read", "p") == set()


@pytest.mark.parametrize("verb", VERBS)
def test_every_verb_has_a_manual_page_with_its_options(verb: str) -> None:
    page = works(ecdaq(None, "manual", verb))
    name = f"ecdaq-{verb}".replace("-", "\\-")
    assert page.startswith(f'.TH "{name}" 1 ')
    text = page.replace("\\-", "-")
    assert f"\\fBecdaq {verb}\\fR [OPTION...] {VERBS[verb]}" in text
    for option in options_of(verb):
        assert f"\\fB{option}\\fR" in text


def test_the_manual_page_of_ecdaq_has_every_verb() -> None:
    page = works(ecdaq(None, "manual"))
    for verb in [*VERBS, "log", "security"]:
        assert f"\n\\fB{verb}\\fR" in page
    assert f"{NO_DAEMON}  no ecdaqd" in page.replace("\\-", "-")
    fails(ecdaq(None, "manual", "frob"), USAGE, "frob: unknown command")


def test_help_of_a_verb_is_what_its_option_prints() -> None:
    assert works(ecdaq(None, "help")) == works(ecdaq(None, "--help"))
    for verb in VERBS:
        assert works(ecdaq(None, "help", verb)) == works(ecdaq(None, verb, "--help"))
    fails(ecdaq(None, "help", "frob"), USAGE, "frob: unknown command")


@pytest.mark.skipif(shutil.which("groff") is None, reason="no groff")
@pytest.mark.parametrize("verb", [*VERBS, ""])
def test_groff_has_no_complaint(verb: str) -> None:
    page = works(ecdaq(None, "manual", *([verb] if verb else [])))
    got = subprocess.run(
        ["groff", "-man", "-Tascii", "-ww"], input=page, capture_output=True, text=True, check=True
    )
    assert got.stderr == ""


def is_page(text: str, verb: str) -> bool:
    return text == works(ecdaq(None, "manual", *([verb] if verb else [])))


def verb_of(page: Path) -> str:
    assert page.suffix == ".1"
    return page.stem.removeprefix("ecdaq").removeprefix("-")


def test_all_pages_are_written_to_a_folder(tmp_path: Path) -> None:
    assert works(ecdaq(None, "manual", "--write", str(tmp_path))) == ""
    pages = {verb_of(page): page.read_text() for page in tmp_path.iterdir()}
    # log and security are programs, with pages of their own.
    assert set(pages) == {*VERBS, ""} - {"log", "security"}
    assert all(is_page(text, verb) for verb, text in pages.items())
    fails(ecdaq(None, "manual", "--write", str(tmp_path), "sdo"), USAGE, "exclude each other")


def test_a_folder_for_pages_that_is_not_there_is_named(tmp_path: Path) -> None:
    there = tmp_path / "no"
    fails(ecdaq(None, "manual", "--write", str(there)), FAILED, f"{there}/ecdaq.1: No such file")
    fails(ecdaq(None, "manual", "--write", "x" * 5000), USAGE, "the path is too long")


def test_completion_and_pages_are_installed() -> None:
    completion = SHARE / "bash-completion/completions/ecdaq"
    assert completion.read_text() == works(ecdaq(None, "completion"))
    pages = {verb_of(page): page.read_text() for page in (SHARE / "man/man1").iterdir()}
    assert set(pages) == {*VERBS, ""} - {"log", "security"}
    assert all(is_page(text, verb) for verb, text in pages.items())
