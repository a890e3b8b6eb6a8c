# SPDX-License-Identifier: MIT
"""The code of the tutorial page, on a recording."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import matplotlib
import pytest
from made import ROOT

matplotlib.use("Agg")
PAGE = ROOT / "app" / "doc" / "tutorial" / "notebook.md"
CODE = re.findall(r"<<'PYTHON'\n(.*?)PYTHON", PAGE.read_text(), re.DOTALL)


def run_code(code: str, folder: Path, picture: Path) -> dict[str, Any]:
    names: dict[str, Any] = {}
    exec(
        code.replace("build/run/record", str(folder)).replace("build/sine.png", str(picture)), names
    )
    return names


def test_six_lines_lead_to_frequency_amplitude_offset_and_snr(
    recorded: Callable[..., Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    recorded("--cycles", "200")  # an earlier run
    folder = recorded("--cycles", "5000", "--skip", "700:20", "--bad", "100")
    assert CODE[0].count("\n") <= 6
    fit = run_code(CODE[0], folder, tmp_path)["fit"]
    assert fit.frequency_hz == pytest.approx(1, abs=1e-4)
    assert fit.amplitude == pytest.approx(0.5, abs=1e-3)
    assert fit.offset == pytest.approx(1, abs=1e-3)
    assert 60 < fit.snr_db < 70
    printed = capsys.readouterr().out
    assert "1.0000 Hz, amplitude 0.5000 V, offset 1.0000 V\n" in printed
    assert "1 gaps" in printed


def test_the_table_and_the_picture_of_the_page_are_made(
    recorded: Callable[..., Path], tmp_path: Path
) -> None:
    names = run_code(CODE[1], recorded("--cycles", "1000"), tmp_path / "sine.png")
    assert names["frame"].attrs["units"] == {"piccolo0.adc": "V", "piccolo1.adc": "V"}
    assert (tmp_path / "sine.png").read_bytes().startswith(b"\x89PNG")
