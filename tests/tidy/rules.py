# SPDX-License-Identifier: MIT
"""The rules of the source tree. Each takes one file and gives its breaches.

A rule is a function; RULES lists them. test_rules.py shows for each that it can fail.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Callable, Iterable

from project import Finding, Source, functions, strip_comments

Rule = Callable[[Source], Iterable[Finding]]

# Which wing may include which (and always itself).
WING_TABLE: dict[str, set[str]] = {
    "core": set(),
    "master": {"core"},
    "services": {"core"},
    "cli": {"core"},
    "sim": {"core/base", "core/wire"},
    "examples": set(),
}
# What each module of a wing may include of the other modules, and always its own.
READERS = {"base", "image", "config", "program", "reader"}
MODULES: dict[str, dict[str, set[str]]] = {
    "core": {
        "base": set(),
        "wire": {"base"},
        "xml": {"base"},
        "esi": {"base", "wire", "xml"},
        "eni": {"base", "wire", "xml"},
        "config": {"base", "image"},
        "program": {"base", "config", "wire/al.h"},
        "image": {"base", "wire"},
        "reader": {"base", "image", "config/config.h"},  # names of the files in the run directory
    },
    "master": {
        "control": {"base", "config", "image"},
        "link": {"base", "wire", "image"},
        "mailbox": {"base", "wire"},
        "bus": {"base", "wire", "config", "esi", "image", "link", "mailbox"},
        "network": {"base", "wire", "mailbox"},
        "cycle": {"base", "wire", "config", "image", "link", "bus", "control"},
        "admin": {"base", "wire", "config", "image", "cycle"},
        "daemon": {"base", "wire", "config", "image", "link", "bus", "control", "cycle", "admin"}
        | {"esi", "mailbox", "network", "program"},
    },
    "services": {
        "record": READERS,
        "keystore": {"base", "program"},
        "publish": READERS | {"keystore"},
        "sync0": READERS,
        "web": READERS
        | {"record/layout.h", "record/messages.h"}
        | {"record/envelope.h", "record/file_io.h", "record/overview.h", "record/store.h"}
        | {"wire/al.h"},
        "uplink": {"base", "config", "program", "xml/xml.h"}
        | {"record/file_io.h", "record/mcap_recover.h", "record/store.h", "record/track.h"}
        | {"record/upload_mark.h"},
        "stream": READERS
        | {"record/layout.h", "record/messages.h"}
        | {"record/file_io.h", "record/mcap_reader.h", "record/store.h", "record/track.h"},
    },
    "cli": {
        "cli": READERS
        | {"wire/al.h", "wire/sii.h"}
        | {"wire/aoe.h", "wire/eoe.h", "wire/soe.h"}
        | {"wire/datagram.h", "wire/esc_reg.h", "wire/fmmu.h"}
        | {"eni", "esi", "wire/coe_type.h"}
    },
    "sim": {
        "firmware": {"base", "wire"},
        "segment": {"base", "wire"},
        "devices": {"base", "wire", "segment", "firmware"},
        "simulator": {"base", "wire", "segment", "devices"},
    },
    "examples": {"examples": set()},  # <ecdaq/reader.h> and <ecdaq/control.h>, as a user
}
INCLUDE_TABLE = {module: seen for modules in MODULES.values() for module, seen in modules.items()}
WING_OF = {module: wing for wing, modules in MODULES.items() for module in modules}

SOEM_HEADER = r"(?:ethercat\w*|nicdrv|oshw|osal|osal_defs|soem/\w+)\.h"
# Foreign headers, and the only modules that may see them.
FOREIGN_HEADERS: list[tuple[str, set[str]]] = [
    (SOEM_HEADER, {"link", "bus"}),
    (r"dds/.*|ddsc/.*", {"publish"}),
    (r"openssl/.*", {"keystore", "uplink"}),
    (r"gpiod\.h|linux/gpio\.h", {"sync0"}),
    (r"yaml\.h", {"config"}),
    (r"zstd\w*\.h", {"record"}),
    (r"expat\.h", {"xml"}),
    (r"libwebsockets\.h", {"web"}),
    (r"cjson/.*", {"web", "stream"}),
    (r"nats/.*", {"stream"}),
    (r"curl/.*", {"uplink"}),
]

# Programs talk to a person; what is not matched here is library code.
PROGRAM = r"^app/(?:cli|core/program|master/daemon|services|sim|examples)/|_main\.c$"
# Calls, what to use instead, and the paths where they are all right.
BANNED_CALLS: list[tuple[str, str, str]] = [
    (
        r"(?:strcpy|stpcpy|strcat|strncpy|strncat|sprintf|vsprintf|gets)\s*\(",
        "snprintf, memcpy",
        "",
    ),
    (r"ato(?:i|l|ll|f)\s*\(", "strtol and its kin, with the end checked", ""),
    (r"strtok\s*\(", "strtok_r or strcspn", ""),
    (r"(?:usleep|ualarm)\s*\(", "platform sleep_until to an absolute deadline", ""),
    (
        r"(?:nano)?sleep\s*\(",
        "platform sleep_until, or poll() with a deadline",
        r"/(?:cli|examples)/",
    ),
    (r"(?:gettimeofday|ftime)\s*\(", "clock_gettime", ""),
    (r"(?:gmtime|localtime|ctime|asctime)\s*\(", "gmtime_r, strftime", ""),
    (r"signal\s*\(", "sigaction or signalfd", ""),
    (r"(?:system|popen)\s*\(", "nothing: no shell is started from C", ""),
    (r"(?:setenv|unsetenv|putenv)\s*\(", "nothing: getenv() is safe only while none is called", ""),
    (r"alloca\s*\(", "an array of fixed size", ""),
    (r"(?:tmpnam|mktemp|tempnam)\s*\(", "mkstemp", ""),
    (r"(?:s?rand|s?random|drand48)\s*\(", "base/prng.h, seeded", ""),
    (
        r"(?:v?printf|puts|putchar|perror|v?syslog)\s*\(|v?fprintf\s*\(\s*std|fputs\s*\(.*\bstd\w+\)",
        "a negative errno or an event: library code never logs",
        PROGRAM,
    ),
]
# Allocation belongs to start-up: these modules allocate in functions that are named for it.
NO_ALLOCATION_MODULES = ("wire", "image", "control", "cycle", "link")
ALLOCATING_FUNCTION = re.compile(r"_(create|open|start|grow|load|copy)\b|^main$")

FUNCTION_LINES = 70
# 400 is the aim. Up to 600 where a second file would need a private header.
FILE_LINES = 600
# Files that are tables, or a subject that does not fall into two; 800 lines at most. Each with why.
LONG_FILE_LINES = 800
LONG_FILES: dict[str, str] = {}
# Files whose one function is a table of texts.
LONG_FUNCTIONS: dict[tuple[str, str], str] = {
    ("app/core/base/event.c", "event_format"): "one text an event",
}

SLEEPING_TESTS = {"tests/sim/harness/rt_guard_test.c": "sleeps for 0 s, to be caught at it"}

# Hosts and paths are spelt in pieces, so that this file keeps its own rule.
BANNED_TEXT: list[tuple[str, str]] = [
    (
        "|".join(
            [
                r"pypi\." + "org",
                "python" + r"hosted\.",
                r"crates\." + "io",
                r"npmjs\." + "(?:org|com)",
                r"(?:deb|security|snapshot|ftp)[\w.]*\.debian\." + "org",
                "proxy" + r"\.golang\.",
                r"repo[\w.]*\.maven",
            ]
        ),
        "host of a package registry: the machine's own configuration names it",
    ),
    (r"(?<![\w.~}-])/" + r"(?:work|root)/", "path of one machine"),
]


# What is decided in one place: the words that decide it, where they may be, what others use.
ONE_PLACE: list[tuple[str, str, str]] = [
    (
        r"#\s*include\s+\"base/ring\.h\"",
        r"^app/(core/(base|reader)|master/(daemon|cycle))/|^app/master/link/capture\.c$"
        r"|^app/services/sync0/output\.c$",
        "only producers and core/reader see the ring: use reader/reader.h, reader/feed.h",
    ),
    # What a control program is given in slaves_bad is the cycle's, under the same name.
    (
        r"(?:->|\.)slaves_bad\b",
        r"^app/(core/reader|master/(cycle|control))/",
        "which sample is good is decided once: sample_is_good() of reader/table.h",
    ),
    (
        r"\bversion\s*[!=]=\s*SAMPLE_VERSION\b",
        r"^app/core/reader/table\.c$",
        "a sample ring's tables are checked once: channel_table_create()",
    ),
    (
        r"\btimemap_(?:tai_to_utc_ns|note_tai_offset)\b",
        r"^app/core/(base|reader)/",
        "samples are mapped to UTC once: reader/utc.h",
    ),
]


def rule_one_place(source: Source) -> Iterable[Finding]:
    """A decision that all readers share is taken in one place."""
    if not source.is_app_c:
        return
    stripped = strip_comments(source.text).splitlines()
    for number, (raw, line) in enumerate(zip(source.lines, stripped, strict=False), 1):
        for pattern, where, instead in ONE_PLACE:
            text = raw if pattern.startswith("#") else line
            if re.search(pattern, text) and not re.search(where, source.path):
                yield Finding(source.path, number, instead)


def rule_includes(source: Source) -> Iterable[Finding]:
    """The include table."""
    if not source.is_app_c or source.module not in INCLUDE_TABLE:
        return
    allowed = INCLUDE_TABLE[source.module] | {source.module}
    for number, line in enumerate(source.lines, 1):
        match = re.match(r"\s*#\s*include\s+([<\"])([^>\"]+)[>\"]", line)
        if not match:
            continue
        header = match.group(2)
        for pattern, modules in FOREIGN_HEADERS:
            if re.fullmatch(pattern, header) and source.module not in modules:
                where = ", ".join(sorted(modules))
                yield Finding(source.path, number, f"{header} is for {where} only")
        module = header.split("/")[0]
        is_ours = match.group(1) == '"' and "/" in header and module in INCLUDE_TABLE
        if not is_ours:
            continue
        if module not in allowed and header not in allowed:
            yield Finding(source.path, number, f"{source.module} must not include {header}")
        if not wing_may_include(source.wing, module):
            yield Finding(source.path, number, f"wing {source.wing} must not include {header}")


def wing_may_include(wing: str, module: str) -> bool:
    """Whether files of @wing may include headers of @module."""
    other = WING_OF[module]
    allowed = WING_TABLE[wing]
    return other == wing or other in allowed or f"{other}/{module}" in allowed


def rule_known_module(source: Source) -> Iterable[Finding]:
    """Every folder of C below app/ is in the include table."""
    if source.is_app_c and source.module not in INCLUDE_TABLE:
        yield Finding(source.path, 1, f"app/{source.module}/ is not in the include table")


def rule_banned_calls(source: Source) -> Iterable[Finding]:
    """Calls that have a better one."""
    if not source.is_app_c:
        return
    for number, line in enumerate(strip_comments(source.text).splitlines(), 1):
        for call, instead, where in BANNED_CALLS:
            match = re.search(rf"(?<![\w.>])(?:{call})", line)
            if match and not (where and re.search(where, source.path)):
                name = match.group(0).split("(")[0].rstrip()
                yield Finding(source.path, number, f"{name}(): use {instead}")


def rule_realtime_clock(source: Source) -> Iterable[Finding]:
    """CLOCK_REALTIME steps; only the recorder's time map may look at it."""
    if not source.is_app_c or source.module in ("record", "cli"):
        return
    for number, line in enumerate(strip_comments(source.text).splitlines(), 1):
        if re.search(r"\bCLOCK_REALTIME\b", line):
            yield Finding(source.path, number, "CLOCK_REALTIME: use CLOCK_MONOTONIC or CLOCK_TAI")


def rule_allocation(source: Source) -> Iterable[Finding]:
    """Modules that the cycle runs through allocate at start only."""
    if not source.is_app_c or source.module not in NO_ALLOCATION_MODULES:
        return
    lines = strip_comments(source.text).splitlines()
    for function in functions(source.text):
        if ALLOCATING_FUNCTION.search(function.name):
            continue
        for number in range(function.line, function.line + function.length):
            if re.search(r"\b(?:malloc|calloc|realloc|strdup|asprintf)\s*\(", lines[number - 1]):
                what = f"{function.name}() allocates; only *_create, *_open, *_start may here"
                yield Finding(source.path, number, what)


def rule_unfinished(source: Source) -> Iterable[Finding]:
    """Nothing left for later, nothing switched off."""
    if not source.is_c:
        return
    for number, line in enumerate(source.lines, 1):
        if re.search(r"\bFIX" + r"ME\b|\bX" + r"XX\b", line):
            yield Finding(source.path, number, "unfinished: do it, or open an issue")
        if re.match(r"\s*#\s*if\s+0\b", line):
            yield Finding(source.path, number, "#if 0: delete it, git remembers")


def rule_bool_parameters(source: Source) -> Iterable[Finding]:
    """A public call with a bool parameter cannot be read at the call: use an enum."""
    if not source.is_app_c or not source.path.endswith(".h"):
        return
    text = strip_comments(source.text)
    for match in re.finditer(r"^\w[^;{}=#]*\(([^;{}]*)\)[^;{}]*;", text, re.MULTILINE):
        if re.search(r"\b(?:bool|_Bool)\s+\w+\s*(?:,|$)", match.group(1)):
            line = text[: match.start()].count("\n") + 1
            yield Finding(source.path, line, "bool parameter in a public call: use an enum")


def rule_file_size(source: Source) -> Iterable[Finding]:
    """A file holds one subject."""
    if not source.path.endswith((".c", ".h", ".py", ".sh")):
        return
    is_list = source.path.startswith("tests/") and source.is_c  # one sentence after the other
    limit = LONG_FILE_LINES if is_list or source.path in LONG_FILES else FILE_LINES
    if len(source.lines) > limit:
        yield Finding(source.path, limit + 1, f"{len(source.lines)} lines, {limit} are the limit")


def rule_function_size(source: Source) -> Iterable[Finding]:
    """A function fits on a screen."""
    if source.is_c:
        found = [(f.name, f.line, f.length) for f in functions(source.text)]
    elif source.path.endswith(".py"):
        nodes = ast.walk(ast.parse(source.text))
        found = [
            (node.name, node.lineno, (node.end_lineno or node.lineno) - node.lineno + 1)
            for node in nodes
            if isinstance(node, ast.FunctionDef)
        ]
    else:
        return
    for name, line, length in found:
        if length > FUNCTION_LINES and (source.path, name) not in LONG_FUNCTIONS:
            yield Finding(source.path, line, f"{name}() has {length} lines, {FUNCTION_LINES} fit")


def rule_spdx(source: Source) -> Iterable[Finding]:
    """The licence is in the first line, or the second of a script."""
    name = source.path.rsplit("/", 1)[-1]
    suffixes = (".c", ".h", ".py", ".sh", ".cmake", ".yaml", ".yml", ".bb", ".inc", ".toml")
    if not name.endswith(suffixes) and name not in ("CMakeLists.txt", "run"):
        return
    head = [line for line in source.lines[:2] if not line.startswith("#!")]
    if not head or "SPDX-License-Identifier: MIT" not in head[0]:
        yield Finding(source.path, 1, "no SPDX-License-Identifier in the first line")


def rule_banned_text(source: Source) -> Iterable[Finding]:
    """No host of a package registry, no path of one machine."""
    for number, line in enumerate(source.lines, 1):
        for pattern, why in BANNED_TEXT:
            match = re.search(pattern, line)
            if match:
                yield Finding(source.path, number, f"'{match.group(0)}': {why}")


def rule_foreign_code(source: Source) -> Iterable[Finding]:
    """SOEM is fetched, never kept here; captures and images of real slaves are not ours."""
    if source.path.startswith("app/third_party/soem/"):
        yield Finding(source.path, 1, "SOEM's sources are unpacked by fetch-soem.sh, not tracked")
    if source.is_c and re.search(r"GNU General Public License|Copyright \(C\)", source.text):
        yield Finding(source.path, 1, "another project's notice: foreign code does not belong here")


def rule_patch_reason(source: Source) -> Iterable[Finding]:
    """A patch is numbered, and its text has the reason before the change."""
    if not source.path.endswith(".patch"):
        return
    name = source.path.rsplit("/", 1)[-1]
    if not re.fullmatch(r"\d{4}-[a-z0-9-]+\.patch", name):
        yield Finding(source.path, 1, "a patch is named NNNN-what-it-does.patch")
    header = re.split(r"^(?:---|diff) ", source.text, maxsplit=1, flags=re.MULTILINE)[0]
    prose = [line for line in header.splitlines() if len(line.split()) >= 4]
    if len(prose) < 2:
        yield Finding(source.path, 1, "a patch begins with its reason, two lines at least")


def rule_test_waits(source: Source) -> Iterable[Finding]:
    """Tests wait for what happens, not for time to pass."""
    if not source.path.startswith("tests/") or source.path in SLEEPING_TESTS:
        return
    if source.is_c:
        for number, line in enumerate(strip_comments(source.text).splitlines(), 1):
            if re.search(r"\b(?:sleep|usleep|nanosleep)\s*\(", line):
                yield Finding(source.path, number, "a test does not sleep: wait for the event")
    if source.path.endswith(".py"):
        yield from python_sleeps(source)


def python_sleeps(source: Source) -> Iterable[Finding]:
    """time.sleep() outside a function that polls, by its name."""
    tree = ast.parse(source.text)
    polling = [
        range(node.lineno, (node.end_lineno or node.lineno) + 1)
        for node in ast.walk(tree)
        if isinstance(node, ast.FunctionDef) and node.name.lstrip("_").startswith(("wait", "poll"))
    ]
    for node in ast.walk(tree):
        is_sleep = isinstance(node, ast.Call) and ast.unparse(node.func) in ("sleep", "time.sleep")
        if is_sleep and not any(node.lineno in lines for lines in polling):
            yield Finding(source.path, node.lineno, "sleep() outside a wait_ or poll_ function")


RULES: list[Rule] = [
    rule_includes,
    rule_known_module,
    rule_one_place,
    rule_banned_calls,
    rule_realtime_clock,
    rule_allocation,
    rule_unfinished,
    rule_bool_parameters,
    rule_file_size,
    rule_function_size,
    rule_spdx,
    rule_banned_text,
    rule_foreign_code,
    rule_patch_reason,
    rule_test_waits,
]
