# SPDX-License-Identifier: MIT
"""Read layers and recipes with BitBake's own library, as BitBake itself would."""

from __future__ import annotations

import importlib
import logging
import os
import sys
import types
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

LAYERS = ("layers/meta-local", "layers/meta-ecdaq")
PASSED_ON = ("ECDAQ_APT_MIRROR", "ECDAQ_APT_SECURITY_MIRROR", "ECDAQ_WIFI")


class MetadataError(Exception):
    """What is wrong with the recipes, in one or more lines FILE:LINE: reason."""


class _Collect(logging.Handler):
    """BitBake reports through logging: keep its errors."""

    def __init__(self) -> None:
        super().__init__(logging.ERROR)
        self.lines: list[str] = []

    def emit(self, record: logging.LogRecord) -> None:
        line = record.getMessage()
        if record.exc_info and record.exc_info[1] is not None:
            line += f": {record.exc_info[1]}"
        self.lines.append(line)


def import_bb() -> Any:
    """The bb package. Its wheel lacks two server modules that it imports and we do not use."""
    for name in ("hashserv", "hashserv.client", "prserv", "prserv.serv"):
        if name not in sys.modules:
            stand_in = types.ModuleType(name)
            sys.modules[name] = stand_in
            parent, _, child = name.rpartition(".")
            if parent:
                setattr(sys.modules[parent], child, stand_in)
    bb = importlib.import_module("bb")
    for name in ("build", "cookerdata", "event", "fetch2", "parse", "process", "utils"):
        importlib.import_module(f"bb.{name}")
    return bb


@dataclass
class Recipe:
    """One parsed recipe: its datastore, and its tasks with what each waits for."""

    name: str
    file: Path
    data: Any
    tasks: dict[str, list[str]] = field(default_factory=dict)

    def flag(self, task: str, name: str) -> str:
        """A flag of a task, expanded, "" if it is not set."""
        return str(self.data.getVarFlag(task, name, True) or "")

    def value(self, name: str) -> str:
        """A variable, expanded, "" if it is not set."""
        return str(self.data.getVar(name) or "")

    def layer(self) -> str:
        """The recipe's folder, below the top of the tree."""
        return self.file.parts[-4] if len(self.file.parts) > 3 else ""


def write_configuration(
    top: Path, build: Path, settings: dict[str, str], layers: Sequence[str]
) -> None:
    """bblayers.conf and local.conf, as one writes them for BitBake."""
    conf = build / "conf"
    conf.mkdir(parents=True, exist_ok=True)
    folders = " ".join(str(top / layer) for layer in layers)
    (conf / "bblayers.conf").write_text(
        f'BBPATH = "${{TOPDIR}}"\nBBFILES = ""\nBBLAYERS = "{folders}"\n'
    )
    lines = [f'{name} = "{value}"\n' for name, value in settings.items()]
    (conf / "local.conf").write_text("".join(lines))


class Metadata:
    """The configuration of one machine and every recipe of the layers, parsed."""

    def __init__(
        self,
        top: Path,
        build: Path,
        settings: dict[str, str],
        layers: Sequence[str] = LAYERS,
    ) -> None:
        self.top = top
        self.configuration: Any = None
        self.bb = import_bb()
        self.recipes: dict[str, Recipe] = {}
        self._collect = _Collect()
        logger = logging.getLogger("BitBake")
        logger.propagate = False
        logger.addHandler(self._collect)
        write_configuration(top, build, settings, layers)
        try:
            self._parse(build)
        finally:
            logger.removeHandler(self._collect)

    def _fail(self, reason: BaseException) -> MetadataError:
        lines = self._collect.lines or [f"{type(reason).__name__}: {reason}"]
        return MetadataError("\n".join(lines))

    def _parse(self, build: Path) -> None:
        bb = self.bb
        configuration = bb.cookerdata.CookerConfiguration()
        configuration.env = {n: os.environ[n] for n in PASSED_ON if n in os.environ}
        configuration.env["PATH"] = os.environ["PATH"]
        os.environ["BB_ENV_PASSTHROUGH_ADDITIONS"] = " ".join(PASSED_ON)
        was = Path.cwd()
        os.chdir(build)
        try:
            builder = bb.cookerdata.CookerDataBuilder(configuration, True)
            builder.parseBaseConfiguration(worker=True)
            self.configuration = builder.data
            for file in self._recipe_files(builder.data):
                self._parse_recipe(builder, file)
        except (bb.BBHandledException, bb.parse.ParseError, bb.data_smart.ExpansionError) as error:
            raise self._fail(error) from error
        except SystemExit as error:
            raise self._fail(error) from error
        finally:
            os.chdir(was)
        if self._collect.lines:
            raise MetadataError("\n".join(self._collect.lines))

    def _recipe_files(self, data: Any) -> list[Path]:
        files: set[Path] = set()
        for pattern in (data.getVar("BBFILES") or "").split():
            base, _, rest = pattern.partition("*")
            root = Path(base).parent if not base.endswith("/") else Path(base)
            full = Path(os.path.normpath(root))
            tail = pattern[len(str(root)) :].lstrip("/") if rest else Path(pattern).name
            files.update(p for p in full.glob(tail) if p.suffix == ".bb")
        return sorted(files)

    def _parse_recipe(self, builder: Any, file: Path) -> None:
        stores = builder.parseRecipeVariants(str(file), [], layername=None)
        data = stores[""]
        if data.getVar("__SKIPPED"):
            return
        recipe = Recipe(data.getVar("PN"), file, data)
        graph = data.getVar("_task_deps", False) or {"tasks": [], "parents": {}}
        for task in graph["tasks"]:
            recipe.tasks[task] = sorted(graph["parents"].get(task, []))
        if recipe.name in self.recipes:
            raise MetadataError(f"{file}: {recipe.name} is also {self.recipes[recipe.name].file}")
        self.recipes[recipe.name] = recipe
