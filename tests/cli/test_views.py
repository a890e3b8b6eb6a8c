# SPDX-License-Identifier: MIT
"""The live views: they fit the terminal, and their keys act."""

from __future__ import annotations

import re
import signal
import subprocess
from collections.abc import Callable, Iterator

import pytest
import yaml
from ecdaq import BUILD, OK, STAGE, Fake, json_lines, works
from terminal import ENTER, LEAVE, Terminal, screens

RIGHT, LEFT = "\x1b[C", "\x1b[D"
UP, DOWN, PAGE_DOWN, END = "\x1b[A", "\x1b[B", "\x1b[6~", "\x1b[F"
WIDTHS = (60, 80, 200)
SII = STAGE / "share/ecdaq/fb1111_piccolo/fb1111_piccolo.bin"


@pytest.fixture(scope="module")
def many(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Fake]:
    """64 slaves."""
    program = BUILD / "tests" / "cli" / "test_fake_daemon_64"
    fake = Fake(tmp_path_factory.mktemp("run64"), program=program)
    yield fake
    fake.close()


def screen_with(terminal: Terminal, condition: Callable[[list[str]], bool]) -> list[str]:
    """The first picture of now on, complete, for which it is true."""
    terminal.text = ""
    found: list[list[str]] = []

    def is_there() -> bool:
        found.extend(one for one in screens(terminal.text)[:-1] if condition(one))
        return found != []

    terminal.wait_until(is_there)
    return found[0]


def drawn_anew(terminal: Terminal, pattern: str = "") -> list[str]:
    """What is shown when a view that draws on a change only has drawn."""
    terminal.wait_until(
        lambda: terminal.text.endswith("\x1b[J") and re.search(pattern, terminal.text) is not None
    )
    return screens(terminal.text)[-1]


def leave(terminal: Terminal) -> None:
    terminal.text = ENTER
    terminal.press("q")
    assert terminal.end() == (OK, "")
    assert terminal.is_restored()


def slaves_of(screen: list[str]) -> list[int]:
    """Positions in the table, from its top."""
    rows = [re.match(r" *(\d+) \S+ +(?:OP|SAFE-OP|LOST)", line) for line in screen]
    return [int(row.group(1)) for row in rows if row]


def fits(screen: list[str], rows: int, columns: int) -> None:
    assert len(screen) <= rows
    assert [line for line in screen if len(line) > columns] == []


@pytest.mark.parametrize("columns", WIDTHS)
def test_top_fits_and_its_table_does_not_move(
    daemon: Fake, terminal: Terminal, columns: int
) -> None:
    terminal.resize(40, columns)
    terminal.start(daemon, "top", "--interval", "20ms")
    terminal.wait_for(r"(?s)(\x1b\[H.*){6}")
    shown = screens(terminal.text)[:5]
    leave(terminal)
    headings = set()
    for screen in shown:
        fits(screen, 40, columns)
        assert slaves_of(screen) == [1, 0]  # trouble first
        heading = next(line for line in screen if line.startswith("pos slave"))
        first, second = (screen[screen.index(heading) + i] for i in (1, 2))
        assert first.split()[:3] == ["1", "piccolo1", "OP"]
        headings.add(heading)
        # The words of the AL status code, behind the slave or below it.
        assert "0x001b SyncManager watchdog" in f"{first} {second}"
        assert not any(line.endswith((" lo", " larg", " rides")) for line in screen)
    assert len(headings) == 1
    text = " ".join(" ".join(line.split()) for line in shown[0])
    for field in ("largest difference 42 ns", "page faults 0", "rides 0", "computed time"):
        assert field in text


@pytest.mark.parametrize("columns", WIDTHS)
def test_64_slaves_are_reached_by_scrolling(many: Fake, terminal: Terminal, columns: int) -> None:
    terminal.resize(24, columns)
    terminal.start(many, "top", "--interval", "20ms", "--sort", "position")
    first = screen_with(terminal, lambda s: "rows 1-" in " ".join(s))
    fits(first, 24, columns)
    visible = len(slaves_of(first))
    assert visible >= 8 and slaves_of(first)[0] == 0
    terminal.press(DOWN)
    screen_with(terminal, lambda s: slaves_of(s)[:1] == [1])
    terminal.press("jj")
    screen_with(terminal, lambda s: "rows 4-" in " ".join(s))
    terminal.press("k" + UP)
    screen_with(terminal, lambda s: slaves_of(s)[:1] == [1])
    terminal.press(PAGE_DOWN)
    screen_with(terminal, lambda s: slaves_of(s)[:1] > [5])
    terminal.press(END)
    last = screen_with(terminal, lambda s: slaves_of(s)[-1:] == [63])
    fits(last, 24, columns)
    terminal.press("g")
    screen_with(terminal, lambda s: slaves_of(s)[:1] == [0])
    leave(terminal)


def test_a_bad_slave_is_on_top_and_s_changes_the_order(many: Fake, terminal: Terminal) -> None:
    terminal.resize(24, 80)
    terminal.start(many, "top", "--interval", "20ms")
    assert slaves_of(screen_with(terminal, lambda s: slaves_of(s) != []))[:3] == [1, 0, 2]
    # By name, bad samples, errors, position, trouble.
    for wanted in ([0, 1, 10], [0, 1, 2], [1, 0, 2], [0, 1, 2], [1, 0, 2]):
        terminal.press("s")
        screen_with(terminal, lambda s, wanted=wanted: slaves_of(s)[:3] == wanted)
    leave(terminal)


def test_a_new_size_is_used_at_once(many: Fake, terminal: Terminal) -> None:
    terminal.resize(50, 200)
    terminal.start(many, "top", "--interval", "60s")
    drawn_anew(terminal, "rows 1-")
    for rows, columns in ((24, 60), (60, 120)):
        terminal.text = ""
        terminal.resize(rows, columns)
        # The size before may be drawn once more in between.
        terminal.wait_until(
            lambda rows=rows: (
                terminal.text.endswith("\x1b[J") and len(screens(terminal.text)[-1]) == rows
            )
        )
        fits(screens(terminal.text)[-1], rows, columns)
    leave(terminal)


def test_question_mark_shows_the_keys_and_any_key_returns(many: Fake, terminal: Terminal) -> None:
    terminal.start(many, "top", "--interval", "60s")
    drawn_anew(terminal, "rows 1-")
    terminal.text = ""
    terminal.press("?")
    text = "\n".join(drawn_anew(terminal))
    for words in ("q, Ctrl-C", "Ctrl-Z", "PgUp", "next order", "details"):
        assert words in text
    assert "piccolo1" not in text
    terminal.text = ""
    terminal.press("x")
    terminal.wait_for("piccolo1")
    leave(terminal)


COLOUR = re.compile(r"\x1b\[[0-9;]*m")


def test_colour_is_shown_on_a_terminal_only_and_not_with_no_color(
    daemon: Fake, terminal: Terminal
) -> None:
    terminal.start(daemon, "status")
    assert terminal.end() == (OK, "") and COLOUR.search(terminal.text)
    for more in ({"NO_COLOR": "1"}, {"TERM": "dumb"}):
        terminal.text = ""
        terminal.start(daemon, "status", **more)
        assert terminal.end() == (OK, "") and "piccolo1" in terminal.text
        assert not COLOUR.search(terminal.text)
    terminal.text = ""
    terminal.start(daemon, "status", NO_COLOR="")
    assert terminal.end() == (OK, "") and COLOUR.search(terminal.text)
    assert "\x1b" not in works(daemon("status"))


@pytest.mark.parametrize("columns", WIDTHS)
def test_status_on_a_terminal_fits(many: Fake, terminal: Terminal, columns: int) -> None:
    terminal.resize(24, columns)
    terminal.start(many, "status")
    assert terminal.end() == (OK, "")
    lines = COLOUR.sub("", terminal.text).replace("\r", "").split("\n")
    assert max(len(line) for line in lines) <= columns
    assert slaves_of(lines) == list(range(64))


@pytest.mark.parametrize("columns", WIDTHS)
def test_a_histogram_fits(daemon: Fake, terminal: Terminal, columns: int) -> None:
    terminal.resize(24, columns)
    terminal.start(daemon, "histogram", "wake")
    assert terminal.end() == (OK, "")
    assert max(len(line) for line in terminal.text.replace("\r", "").split("\n")) <= columns


@pytest.mark.parametrize("columns", WIDTHS)
def test_a_live_histogram_fits_and_grows(daemon: Fake, terminal: Terminal, columns: int) -> None:
    terminal.resize(24, columns)
    terminal.start(daemon, "histogram", "wake", "--interval", "20ms")
    terminal.wait_for(r"(?s)(\x1b\[H.*){8}")
    drawn = screens(terminal.text)[:7]
    leave(terminal)
    counts = []
    for screen in drawn:
        fits(screen, 24, columns)
        found = re.match(r"wake: (\d+) values, p50 ", screen[0])
        assert found and "largest" in " ".join(screen[:2])
        assert any("bars: logarithmic" in line for line in screen[:3])
        counts.append(int(found.group(1)))
    assert counts == sorted(counts) and counts[-1] > counts[0]


def test_keys_of_a_live_histogram(daemon: Fake, terminal: Terminal) -> None:
    terminal.resize(8, 80)
    terminal.start(daemon, "histogram", "wake", "--live")
    screen_with(terminal, lambda s: s[0].startswith("wake: ") and "rows 1-" in s[-1])
    terminal.press(DOWN)
    screen_with(terminal, lambda s: "rows 2-" in s[-1])
    for key, name in ((RIGHT, "round-trip"), (RIGHT, "phase"), (LEFT, "round-trip")):
        terminal.press(key)
        screen_with(terminal, lambda s, name=name: s[0].startswith(f"{name}: "))
    terminal.press(LEFT + LEFT)
    screen_with(terminal, lambda s: s[0] == "control: no values yet")
    terminal.press(RIGHT)
    terminal.resize(24, 60)
    screen_with(terminal, lambda s: len(s) > 3 and max(map(len, s)) <= 60)
    terminal.press("?")
    screen_with(terminal, lambda s: "left, right" in "\n".join(s[1:]) and s[0] == "keys")
    terminal.press("?")
    screen_with(terminal, lambda s: s[0].startswith("wake: "))
    leave(terminal)


def test_a_live_histogram_ends_with_its_count_or_with_ecdaqd(
    daemon: Fake, terminal: Terminal
) -> None:
    terminal.start(daemon, "histogram", "wake", "--count", "2", "--interval", "10ms")
    assert terminal.end() == (OK, "")
    # The last one stays in the terminal.
    assert terminal.is_restored() and "values, p50" in terminal.text.split(LEAVE)[1]
    piped = works(daemon("histogram", "wake", "--count", "3", "--interval", "10ms"))
    assert piped.count("bars: logarithmic") == 3 and "\x1b" not in piped
    three = json_lines(daemon("histogram", "wake", "--count", "3", "--interval", "10ms", "--json"))
    assert [one["histogram"] for one in three] == ["wake"] * 3
    assert three[0]["count"] < three[2]["count"]
    terminal.text = ""
    terminal.start(daemon, "histogram", "work", "--interval", "10ms")
    terminal.wait_for("work: ")
    daemon.kill()
    assert terminal.end() == (OK, "") and terminal.is_restored()


@pytest.mark.parametrize("columns", WIDTHS)
def test_events_fit_and_are_coloured(daemon: Fake, terminal: Terminal, columns: int) -> None:
    terminal.resize(24, columns)
    terminal.start(daemon, "events", "--all")
    assert terminal.end() == (OK, "")
    assert "\x1b[1;31merror" in terminal.text
    lines = COLOUR.sub("", terminal.text).replace("\r", "").split("\n")
    assert max(len(line) for line in lines) <= columns
    joined = " ".join(" ".join(lines).split())
    assert "slave 1 piccolo1: lost" in joined and "started: 2 slaves, period 1000000 ns" in joined


def shown(terminal: Terminal, daemon: Fake, columns: int, *words: str) -> str:
    terminal.resize(24, columns)
    terminal.start(daemon, *words)
    assert terminal.end() == (OK, "")
    text = terminal.text.replace("\r", "")
    assert [line for line in text.split("\n") if len(line) > columns] == []
    assert max(len(line) for line in text.split("\n")) > columns * 0.6 or columns == 200
    return text


@pytest.fixture
def described(fake: Callable[..., Fake]) -> Fake:
    """Slaves with long names and an SII that has PDOs."""
    return fake("SPEED=10", "LONG=1", f"SII={SII}")


@pytest.mark.parametrize("columns", WIDTHS)
@pytest.mark.parametrize("verb", ["pdo", "channels", "cstruct"])
def test_lists_fit_and_nothing_is_cut(
    described: Fake, terminal: Terminal, verb: str, columns: int
) -> None:
    piped = works(described(verb))
    assert shown(terminal, described, columns, verb).split() == piped.split()


def test_names_of_channels_are_in_one_column_where_there_is_room(
    described: Fake, terminal: Terminal
) -> None:
    rows = shown(terminal, described, 80, "channels").splitlines()
    assert {len(row.split()[3]) + row.index(row.split()[3]) for row in rows if " in " in row} == {
        rows[0].index(" at") + 3
    }


@pytest.mark.parametrize("columns", WIDTHS)
def test_the_c_header_on_a_terminal_is_still_one(
    daemon: Fake, terminal: Terminal, columns: int
) -> None:
    text = shown(terminal, daemon, columns, "cstruct")
    compiler = ["gcc", "-std=c17", "-Wall", "-Werror", "-fsyntax-only", "-xc", "-"]
    subprocess.run(compiler, input=text, text=True, check=True)


@pytest.mark.parametrize("columns", WIDTHS)
def test_a_scan_on_a_terminal_is_the_same_configuration(
    fake: Callable[..., Fake], terminal: Terminal, columns: int
) -> None:
    """With and without the lists of channels that are comments."""
    daemon = fake("SPEED=10", f"SII={SII}")
    piped = works(daemon("scan"))
    text = shown(terminal, daemon, columns, "scan")
    assert text.replace("#", "").split() == piped.replace("#", "").split()
    for make in (str, with_channels):
        assert yaml.safe_load(make(text)) == yaml.safe_load(make(piped))
    assert "channels" in yaml.safe_load(with_channels(text))["slaves"][0]


def with_channels(text: str) -> str:
    """@text without the '#' in front of the lists of channels, continued lines included."""
    lists = re.compile(r"^    #channels:\n(?:    #  (?:- |    ).*\n)+", re.MULTILINE)
    return lists.sub(lambda found: re.sub(r"(?m)^    #", "    ", found.group()), text)


def values_of(screen: list[str]) -> dict[str, list[str]]:
    rows = [line.split() for line in screen if re.match(r"[\w~]+[.~]", line)]
    return {row[0]: row[1:] for row in rows}


@pytest.mark.parametrize("columns", WIDTHS)
def test_watch_on_a_terminal_is_a_table_of_values_in_place(
    daemon: Fake, terminal: Terminal, columns: int
) -> None:
    terminal.resize(24, columns)
    terminal.start(daemon, "watch", "piccolo0.adc", "piccolo1.*")
    terminal.wait_for(r"(?s)(\x1b\[H.*){6}")
    shown = screens(terminal.text)[:5]
    leave(terminal)
    for screen in shown:
        fits(screen, 24, columns)
        assert screen[0].startswith("cycle ")
        assert screen[1].split() == ["channel", "value", "unit", "age"]
        assert [line[:8] for line in screen[2:-1]] == ["piccolo0"] + 6 * ["piccolo1"]
    values = [values_of(screen) for screen in shown]
    for value, unit, state, *age in (one["piccolo0.adc"] for one in values):
        assert 0.4 < float(value) < 1.6 and unit == "V" and state in ("good", "BAD")
        # Of the last good sample; there may be none before the first bad ones.
        assert re.match(r"\d+\.\d s$", " ".join(age)) or (state, age) == ("BAD", ["-"])
    assert any(len(row[0]) == 18 for row in values[0].values())  # sample_time, whole
    assert len({one["piccolo1.counter"][0] for one in values}) > 1
    assert len({screen[2].index("V") for screen in shown}) == 1


def test_a_value_outside_of_its_plausible_range_is_marked_and_comes_first(
    fake: Callable[..., Fake], terminal: Terminal
) -> None:
    """The simulated voltage goes from 0.5 V to 1.5 V; the others have no range."""
    terminal.start(fake("SPEED=10", "ADC_MAX=1"), "watch", "piccolo1.adc", "piccolo0.adc")
    terminal.press("s")

    def is_outside(screen: list[str]) -> bool:
        return values_of(screen).get("piccolo0.adc", [""] * 3)[-3] == "out"

    found = values_of(screen_with(terminal, lambda s: "bad first" in s[-1] and is_outside(s)))
    assert list(found) == ["piccolo0.adc", "piccolo1.adc"]
    assert float(found["piccolo0.adc"][0]) > 1 and found["piccolo1.adc"][-3] == "good"
    inside = values_of(
        screen_with(terminal, lambda s: not is_outside(s) and len(values_of(s)) == 2)
    )
    assert inside["piccolo0.adc"][-3] == "BAD" or float(inside["piccolo0.adc"][0]) <= 1
    leave(terminal)


def test_many_values_scroll_and_bad_ones_come_first(many: Fake, terminal: Terminal) -> None:
    terminal.resize(24, 60)
    terminal.start(many, "watch", "*")
    first = screen_with(terminal, lambda s: "384 channels" in s[-1])
    assert len(first) == 24 and next(iter(values_of(first))) == "piccolo0.led"
    terminal.press(END)
    screen_with(terminal, lambda s: "piccolo63.status" in values_of(s))
    terminal.press("gs")
    screen_with(terminal, lambda s: "bad first" in s[-1])
    # Each 64th cycle of the fake ecdaqd is lost, with all of its values.
    bad = screen_with(terminal, lambda s: "lost" in s[0])
    assert {row[-3] for row in values_of(bad).values()} == {"BAD"}
    leave(terminal)


@pytest.mark.parametrize("option", ["--count=3", "--every=1", "--rate=100", "--json"])
def test_watch_prints_lines_on_a_terminal_if_told_which(
    daemon: Fake, terminal: Terminal, option: str
) -> None:
    terminal.start(daemon, "watch", "piccolo0.adc", option)
    terminal.wait_for(r"(?s)(\n.*){3}")
    if option != "--count=3":
        assert terminal.process is not None
        terminal.process.send_signal(signal.SIGINT)
    code, _ = terminal.end()
    assert code == OK and ENTER not in terminal.text


@pytest.mark.parametrize("columns", WIDTHS)
def test_a_plot_fits_and_has_units_and_round_ticks(
    daemon: Fake, terminal: Terminal, columns: int
) -> None:
    terminal.resize(24, columns)
    terminal.start(daemon, "watch", "--plot", "piccolo0.adc", "piccolo1.adc", "--window", "1s")
    terminal.wait_for(r"(?s)(\x1b\[H.*){4}")
    screen = screens(terminal.text)[2]
    leave(terminal)
    fits(screen, 24, columns)
    assert re.match(r"piccolo0\.adc   now \S+ V   min 0\.(49|50)\d*   max 1\.(49|5)\d*$", screen[0])
    labels = [float(line.split("|")[0]) for line in screen[1:10] if line.split("|")[0].strip()]
    assert max(labels) in (1.5, 2.0) and {label * 2 % 1 for label in labels} == {0.0}
    assert re.search(r"-0\.5 s.*now$", screen[-2])


def test_a_paused_plot_stays_at_any_size_and_cursors_measure_it(
    daemon: Fake, terminal: Terminal
) -> None:
    terminal.resize(24, 80)
    terminal.start(daemon, "watch", "--plot", "piccolo0.adc", "--window", "1s")
    screen_with(terminal, lambda s: "now " in s[0])
    terminal.press(" ")
    paused = screen_with(terminal, lambda s: "PAUSED" in s[-1])
    terminal.resize(24, 120)
    wide = screen_with(terminal, lambda s: max(map(len, s)) > 100)
    assert wide[0] == paused[0]
    terminal.resize(24, 80)
    assert screen_with(terminal, lambda s: max(map(len, s)) <= 80) == paused
    terminal.press("c")
    on = screen_with(terminal, lambda s: "dy " in s[0])
    assert re.match(r"piccolo0\.adc   A \S+   B \S+   dy \S+ V$", on[0])
    assert re.search(r"dt 33\d\.?\d* ms \((2\.9|3\.0)\d* Hz\)", on[-1]) and "A" in on[-3]
    # B from a third of the window to its right end.
    terminal.press("\t" + 20 * "\x1b[C")
    moved = screen_with(terminal, lambda s: on[-3].index("B") < s[-3].find("B"))
    assert moved[0] != on[0]
    terminal.press("c ")
    screen_with(terminal, lambda s: "PAUSED" not in s[-1] and "now " in s[0] and s[0] != paused[0])
    leave(terminal)
