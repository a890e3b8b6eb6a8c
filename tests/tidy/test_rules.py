# SPDX-License-Identifier: MIT
"""Every rule can fail: for each, a file that breaks it and one that keeps it."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import pytest
import rules
import whole_tree
from project import Source, functions

LONG_FUNCTION = "int f(void)\n{\n" + "\tg();\n" * 68 + "}\n"
SPDX_C = "/* SPDX-License-Identifier: MIT */\n"
HOST = "https://" + "py" + "pi.org/simple"
PLACE = "/" + "work/main/x"


@dataclass(frozen=True)
class Case:
    """A rule, the path of the file, and what is wrong and right there."""

    rule: rules.Rule
    path: str
    bad: str
    good: str


CASES = [
    Case(
        rules.rule_includes, "app/core/wire/a.c", '#include "bus/bus.h"', '#include "base/bytes.h"'
    ),
    Case(rules.rule_includes, "app/core/base/a.c", '#include "wire/al.h"', '#include "clock.h"'),
    Case(rules.rule_includes, "app/cli/a.c", '#include "cycle/cycle.h"', '#include "base/ring.h"'),
    Case(rules.rule_includes, "app/cli/a.c", '#include "record/mcap.h"', '#include "base/args.h"'),
    Case(
        rules.rule_includes,
        "app/cli/a.c",
        '#include "admin/a.h"',
        '#include "base/admin_protocol.h"',
    ),
    Case(
        rules.rule_includes, "app/sim/segment/a.c", '#include "link/line.h"', '#include "wire/al.h"'
    ),
    Case(rules.rule_includes, "app/core/config/a.c", '#include "bus/bus.h"', "#include <yaml.h>"),
    Case(
        rules.rule_includes, "app/master/cycle/a.c", '#include "ethercat.h"', '#include "bus/bus.h"'
    ),
    Case(rules.rule_includes, "app/master/cycle/a.c", "#include <oshw.h>", "#include <sched.h>"),
    Case(
        rules.rule_includes, "app/services/record/a.c", "# include <dds/dds.h>", "#include <zstd.h>"
    ),
    Case(rules.rule_includes, "app/cli/a.c", "#include <gpiod.h>", "#include <poll.h>"),
    Case(rules.rule_known_module, "app/misc/a.c", "int a;", ""),
    Case(rules.rule_banned_calls, "app/cli/a.c", "\tstrcpy(a, b);", "\tsnprintf(a, 4, b);"),
    Case(rules.rule_banned_calls, "app/cli/a.c", "\tn = atoi(s);", "\tn = strtol(s, &e, 10);"),
    Case(rules.rule_banned_calls, "app/cli/a.c", "\tusleep (5);", "/* usleep(5) is banned */"),
    Case(
        rules.rule_banned_calls,
        "app/master/bus/a.c",
        '\tprintf("x");',
        '\tsnprintf(b, 2, "printf(");',
    ),
    Case(
        rules.rule_banned_calls, "app/master/bus/a.c", "\tfprintf(stderr, s);", "\tfprintf(out, s);"
    ),
    Case(rules.rule_banned_calls, "app/master/bus/a.c", "\tfputs(s, stderr);", "\tfputs(s, out);"),
    Case(rules.rule_banned_calls, "app/master/bus/a.c", "\tsleep(1);", "\tplat->sleep(1);"),
    Case(
        rules.rule_banned_calls, "app/master/bus/a.c", "\tsignal(2, f);", "\tsigaction(2, &a, 0);"
    ),
    Case(rules.rule_realtime_clock, "app/master/bus/a.c", "t(CLOCK_REALTIME);", "t(CLOCK_TAI);"),
    Case(
        rules.rule_allocation,
        "app/master/cycle/a.c",
        "int cycle_run(void)\n{\n\tp = malloc(4);\n}\n",
        "int cycle_create(void)\n{\n\tp = malloc(4);\n}\n",
    ),
    Case(rules.rule_unfinished, "app/master/bus/a.c", "/* FIX" + "ME later */", "/* fixed */"),
    Case(rules.rule_unfinished, "tests/sim/a.c", "#if  0", "#if 01 == FOO"),
    Case(
        rules.rule_bool_parameters, "app/master/bus/a.h", "int f(int a, bool b);", "bool f(int a);"
    ),
    Case(
        rules.rule_bool_parameters,
        "app/master/bus/a.h",
        "int f(bool a,\n\tint b);",
        "struct { bool a; };",
    ),
    Case(rules.rule_file_size, "app/master/bus/a.c", "\n" * 601, "\n" * 600),
    Case(
        rules.rule_function_size,
        "app/master/bus/a.c",
        LONG_FUNCTION,
        LONG_FUNCTION.replace("\tg();\n", "", 1),
    ),
    Case(rules.rule_function_size, "tests/a.py", "def f():\n" + "    g()\n" * 70, "f = 1\n"),
    Case(
        rules.rule_one_place,
        "app/cli/a.c",
        '#include "base/ring.h"',
        '#include "reader/reader.h"',
    ),
    Case(
        rules.rule_one_place,
        "app/services/record/a.c",
        "is_bad = header->slaves_bad >> pos & 1;",
        "is_good = sample_is_good(header, pos);",
    ),
    Case(
        rules.rule_one_place,
        "app/services/publish/a.c",
        "return meta->version == SAMPLE_VERSION;",
        "return channel_table_create(meta, bytes, &table);",
    ),
    Case(
        rules.rule_one_place,
        "app/services/record/a.c",
        "return timemap_tai_to_utc_ns(map, tai_ns);",
        "return utc_of_tai(utc, tai_ns);",
    ),
    Case(rules.rule_spdx, "app/master/bus/a.c", "int a;\n", SPDX_C + "int a;\n"),
    Case(
        rules.rule_spdx, "app/a.sh", "#!/bin/sh\nset\n", "#!/bin/sh\n# SPDX-License-Identifier: MIT"
    ),
    Case(rules.rule_banned_text, "README.md", f"see {HOST}", "see pip.conf"),
    Case(rules.rule_banned_text, "README.md", f"in {PLACE}", "in ./work/main"),
    Case(rules.rule_foreign_code, "app/third_party/soem/soem/a.c", "int a;", ""),
    Case(
        rules.rule_foreign_code,
        "app/master/bus/a.c",
        "* under the GNU General Public License",
        SPDX_C,
    ),
    Case(rules.rule_patch_reason, "app/third_party/patches/0001-x.patch", "--- a/x\n+++ b/x\n", ""),
    Case(rules.rule_patch_reason, "app/third_party/patches/fix.patch", "--- a/x\n", ""),
    Case(
        rules.rule_test_waits, "tests/unit/master/bus/a.c", "\tusleep(3);", "\tpoll(&p, 1, 1000);"
    ),
    Case(
        rules.rule_test_waits,
        "tests/live/test_a.py",
        "def test_a():\n    time.sleep(1)\n",
        "def wait_until(f):\n    time.sleep(0.01)\n",
    ),
]
GOOD_PATCH = """The expected WKC of a slave with less than a byte is wrong:
SOEM counts it twice. See the segment test.
--- a/x
+++ b/x
"""


@pytest.mark.parametrize("case", CASES, ids=lambda c: f"{c.rule.__name__}: {c.bad.strip()[:40]}")
def test_a_rule_finds_the_breach_and_only_that(case: Case) -> None:
    assert list(case.rule(Source(case.path, case.bad)))
    if not case.path.endswith(".patch") and case.good:
        assert not list(case.rule(Source(case.path, case.good)))


@pytest.mark.parametrize(
    ("wing", "module", "allowed"),
    [
        ("core", "base", True),
        ("core", "cycle", False),
        ("master", "config", True),
        ("master", "record", False),
        ("services", "bus", False),
        ("cli", "record", False),
        ("sim", "wire", True),
        ("sim", "config", False),
    ],
)
def test_a_wing_includes_core_and_itself(wing: str, module: str, allowed: bool) -> None:
    assert rules.wing_may_include(wing, module) == allowed


def test_a_patch_with_number_and_reason_is_fine() -> None:
    assert not list(rules.rule_patch_reason(Source("p/0001-count-once.patch", GOOD_PATCH)))


@pytest.mark.parametrize("rule", rules.RULES, ids=lambda rule: rule.__name__)
def test_each_rule_is_shown_to_fail(rule: rules.Rule) -> None:
    assert any(case.rule is rule for case in CASES)


def test_a_source_that_no_list_names_is_found() -> None:
    lines = "set(dir deep)\necdaq_module(bus SOURCES a.c ${dir}/b.c)"
    built = Source("app/master/bus/CMakeLists.txt", lines)
    named = [Source("app/master/bus/a.c", ""), Source("app/master/bus/deep/b.c", "")]
    assert not list(whole_tree.unlisted_sources([built, *named]))
    for stray in ("app/master/bus/c.c", "app/master/bus/b.c", "app/core/wire/a.c"):
        assert list(whole_tree.unlisted_sources([built, *named, Source(stray, "")]))


def test_a_second_definition_of_what_readers_share_is_found() -> None:
    body = "int sample_is_good(void)\n{\n\treturn 1;\n}\n"
    files = [Source("app/a.c", body), Source("app/b.c", body)]
    found = [f for f in whole_tree.not_defined_once(files) if f.path == "sample_is_good"]
    assert len(found) == 1
    assert not [f for f in whole_tree.not_defined_once(files[:1]) if f.path == "sample_is_good"]


def test_a_doubled_test_name_is_found() -> None:
    one = Source("tests/unit/master/bus/a.c", "TEST(bus, works)\n")
    two = Source("tests/unit/master/bus/b.c", "TEST(bus,  works)\n")
    assert not list(whole_tree.doubled_test_names([one]))
    assert list(whole_tree.doubled_test_names([one, two]))


def test_a_test_that_cmake_would_not_see_is_found() -> None:
    assert list(whole_tree.unseen_tests([Source("tests/unit/a/a.c", "TEST(bus,\n     works)\n")]))
    assert not list(whole_tree.unseen_tests([Source("tests/unit/a/a.c", "TEST(bus, works)\n")]))


def test_an_exception_without_need_is_found() -> None:
    long, short = Source("app/a/l.c", "\n" * 500), Source("app/a/s.c", "\n")
    assert not list(whole_tree.stale_exceptions([long, short], ["app/a/l.c"], 400))
    assert list(whole_tree.stale_exceptions([long, short], ["app/a/s.c"], 400))
    assert list(whole_tree.stale_exceptions([long, short], ["app/a/gone.c"], 400))


def test_a_copy_of_shared_data_is_found(tmp_path: Path) -> None:
    data, tree = tmp_path / "data", tmp_path / "tree"
    for folder in (data, tree):
        folder.mkdir()
    (data / "el1008.bin").write_bytes(b"\1\2\3")
    (tree / "corpus-1").write_bytes(b"\1\2\3")
    (tree / "own").write_bytes(b"\1\2\4")
    (tree / "a.pcapng").write_bytes(b"x")
    assert list(whole_tree.foreign_binaries(tree, ["corpus-1"], data))
    assert list(whole_tree.foreign_binaries(tree, ["a.pcapng"], data))
    assert not list(whole_tree.foreign_binaries(tree, ["own"], data))


def test_functions_are_measured_from_head_to_brace() -> None:
    text = (
        "static int x;\n\nint f(int a,\n      int b)\n{\n\tif (a) {\n\t}\n}\n\nint g(void)\n{\n}\n"
    )
    assert [(f.name, f.length) for f in functions(text)] == [("f", 6), ("g", 3)]
