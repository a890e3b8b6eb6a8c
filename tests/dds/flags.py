# SPDX-License-Identifier: MIT
"""The flags of a sample, read from base/sample.h."""

from __future__ import annotations

import re

from bench import ROOT

HEADER = (ROOT / "app" / "core" / "base" / "sample.h").read_text()
BITS = {name: int(bit) for name, bit in re.findall(r"\bSAMPLE_(\w+) = 1u << (\d+)", HEADER)}

LOST = 1 << BITS["LOST"]
WKC_LOW = 1 << BITS["WKC_LOW"]
NOT_OP = 1 << BITS["NOT_OP"]
SKIPPED = 1 << BITS["SKIPPED"]
# No answer of a slave in OP is in these cycles: skipped ones have no frame, lost ones have none
# that came back. The outputs of a lost frame may be in the slaves, or not.
UNANSWERED = LOST | WKC_LOW | NOT_OP | SKIPPED
