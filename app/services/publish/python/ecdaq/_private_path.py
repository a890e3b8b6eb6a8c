# SPDX-License-Identifier: MIT
"""What the Debian package brings that Debian does not have; what the machine has comes first."""

import sys
from pathlib import Path

_PRIVATE = Path(__file__).parent / "_private"
if _PRIVATE.is_dir():
    sys.path.append(str(_PRIVATE))
