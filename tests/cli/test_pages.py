# SPDX-License-Identifier: MIT
"""Completion and manual pages have every verb and every option."""

from __future__ import annotations

import os
import re
import shutil
import subprocess

import pytest
from ecdaq import ECDAQ, NO_DAEMON, USAGE, Fake, ecdaq, fails, works
from test_usage import VERBS

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
    assert page.startswith(f'.TH "ecdaq\\-{verb}" 1 ')
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


@pytest.mark.skipif(shutil.which("groff") is None, reason="no groff")
@pytest.mark.parametrize("verb", [*VERBS, ""])
def test_groff_has_no_complaint(verb: str) -> None:
    page = works(ecdaq(None, "manual", *([verb] if verb else [])))
    got = subprocess.run(
        ["groff", "-man", "-Tascii", "-ww"], input=page, capture_output=True, text=True, check=True
    )
    assert got.stderr == ""
