# SPDX-License-Identifier: MIT
"""The tree can be read one unit after the other, but for a few circles; and the count can fail."""

from __future__ import annotations

from circles import CIRCLES_LIMIT, circles, folder_graph, include_graph
from project import Source, sources


def tree(texts: dict[str, str]) -> list[Source]:
    return [Source(f"app/core/{name}", text) for name, text in texts.items()]


def test_few_circles_are_left() -> None:
    found = circles(include_graph(sources()))
    listed = "\n".join(" ".join(group) for group in found)
    assert len(found) <= CIRCLES_LIMIT, f"\n{listed}"


def test_no_circle_between_folders() -> None:
    assert not circles(folder_graph(include_graph(sources())))


def test_two_headers_that_include_each_other_are_a_circle() -> None:
    files = tree({"base/a.h": '#include "base/b.h"\n', "base/b.c": '#include "a.h"\n'})
    assert not circles(include_graph(files))
    files += tree({"base/b.h": "", "base/a.c": '#include "base/a.h"\n'})
    assert circles(include_graph(files)) == [["app/core/base/a", "app/core/base/b"]]


def test_a_source_and_its_header_are_one_unit() -> None:
    files = tree(
        {
            "base/a.h": "",
            "base/a.c": '#include "base/a.h"\n#include "base/a_internal.h"\n',
            "base/a_internal.h": '#include "base/a.h"\n',
        }
    )
    assert not circles(include_graph(files))


def test_calls_through_a_private_header_count() -> None:
    private = "int first(void);\nint second(void);\n"
    one = '#include "base/a_internal.h"\nint first(void)\n{\n\treturn second();\n}\n'
    other = '#include "base/a_internal.h"\nint second(void)\n{\n\treturn 0;\n}\n'
    files = tree({"base/a_internal.h": private, "base/a.c": one, "base/b.c": other})
    assert not circles(include_graph(files))
    back = other.replace("return 0", "return first()")
    assert circles(include_graph([*files[:2], *tree({"base/b.c": back})]))


def test_a_circle_between_folders_is_found() -> None:
    files = tree(
        {
            "base/a.h": '#include "wire/b.h"\n',
            "wire/b.h": "",
            "wire/c.h": '#include "base/d.h"\n',
            "base/d.h": "",
        }
    )
    assert not circles(include_graph(files))
    assert circles(folder_graph(include_graph(files))) == [["app/core/base", "app/core/wire"]]
