# SPDX-License-Identifier: MIT
"""Adds to pyproject.toml: ecdaq/idl_types.py is generated from ../idl/ecdaq.idl when pip builds."""

import sys
import tempfile
from pathlib import Path

from setuptools import setup
from setuptools.command.build_py import build_py

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE))

from idl_to_python import generate  # noqa: E402


class BuildTypes(build_py):
    """build_py, and the types from the IDL."""

    def run(self) -> None:
        super().run()
        # Editable: the package is imported from here.
        folder = HERE if self.editable_mode else Path(self.build_lib)
        generate(HERE.parent / "idl" / "ecdaq.idl", folder / "ecdaq" / "idl_types.py")


# pip builds in this folder: what it leaves behind goes elsewhere.
with tempfile.TemporaryDirectory() as scratch:
    setup(
        cmdclass={"build_py": BuildTypes},
        options={"build": {"build_base": scratch}, "egg_info": {"egg_base": scratch}},
    )
