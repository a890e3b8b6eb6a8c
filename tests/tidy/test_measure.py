# SPDX-License-Identifier: MIT
"""What the pages of results take from the output of what was measured."""

from __future__ import annotations

import sys

import pytest
from project import ROOT

sys.path.insert(0, str(ROOT / "app" / "tools"))
from measure.fuzz import searched
from measure.page import NotMeasuredError

LOG = """INFO: seed corpus: files: 12
#90210	DONE   cov: 1200 ft: 4000 corp: 300/9Kb
Done 90210 runs in {seconds} second(s)
stat::number_of_executed_units: 90210
stat::new_units_added:          44
"""


def test_a_search_is_a_line_with_its_runs_and_its_time() -> None:
    line = searched("esi", 3600, LOG.format(seconds=3601))
    assert " ".join(line.split()) == "esi 90210 runs in 3601 s, 44 new inputs, 0 crashes"


@pytest.mark.parametrize(
    "log", [LOG.format(seconds=59), "==1== ERROR: libFuzzer: deadly signal\n", ""]
)
def test_a_search_that_ended_early_is_not_a_figure(log: str) -> None:
    with pytest.raises(NotMeasuredError, match="esi: the search did not take its 60 s"):
        searched("esi", 60, log)
