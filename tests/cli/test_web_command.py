# SPDX-License-Identifier: MIT
"""Log-in, roles and commands of the page: who may what, and what is refused."""

from __future__ import annotations

import json
import os
import re
import shutil
import socket
import stat
import struct
import subprocess
from collections.abc import Callable

import npm
import pytest
from browser import Browser
from ecdaq import NO_DAEMON, REFUSED, USAGE, Fake, ecdaq, fails, json_of
from recording import Bench
from test_web import VIEWER
from test_web_views import AXE, FOUND
from web_bench import Web
from web_client import RejectedError, WebSocket, http
from web_session import ROLES, Session, WebCommand, expect_by_role, post

LED = "piccolo0.led"
WRONG = "0" * 64
# struct web_request of base/web_command.h
REQUEST = struct.Struct("<II65s1024s3x")
MAGIC = 0x32574445
TOKEN = 5
REPLY_BYTES = 8 + 65 + 16384 + 3  # struct web_reply


def test_an_operator_sets_an_output_and_gets_the_cycle(
    daemon: Fake, web: Web, web_command: WebCommand
) -> None:
    session = Session(web, web_command.token("operator"))
    assert session.role == "operator"
    status, text = session.ask("set", LED, "1")
    assert status == 200, text
    answer = json.loads(text)
    assert answer["raw"] == {LED: 1}
    assert answer["cycle"] >= 1000
    assert json_of(daemon("watch", LED, "--count", "1", "--json"))["values"] == {LED: 1}
    log = web_command.stop()
    assert re.search(r"^ecdaq-web-command: a token for one operator, good for 10 min$", log, re.M)
    assert re.search(r"^ecdaq-web-command: operator 1 has logged in$", log, re.M)
    assert re.search(rf"^ecdaq-web-command: operator 1: set {LED} 1: done$", log, re.M)
    for secret in (session.secret, session.cookie.partition("=")[2]):
        assert secret not in log


def test_the_tool_checks_what_is_set_and_its_reason_is_the_answer(
    daemon: Fake, web: Web, web_command: WebCommand
) -> None:
    session = Session(web, web_command.token("operator"))
    for words, why in (
        (("set", "piccolo9.led", "1"), "piccolo9.led"),
        (("set", LED, "2"), "does not fit|is not a value"),
        (("set", "piccolo0.adc", "1"), "is an input"),
        (("set", "piccolo1.led", "1"), "owned by program"),
    ):
        status, text = session.ask(*words)
        assert status == 409
        assert text.startswith("ecdaq: set: ") and re.search(why, text), text
        assert text.count("\n") == 1
    daemon.process.kill()
    daemon.process.wait()
    status, text = session.ask("set", LED, "1")
    assert (status, "ecdaqd" in text) == (409, True)


@pytest.mark.parametrize("role", ROLES)
def test_each_role_may_do_what_it_may(
    daemon: Fake, web: Web, web_command: WebCommand, role: str
) -> None:
    session = Session(web, web_command.token(role))
    commands = (
        ("operator", ("set", LED, "1")),
        ("engineer", ("state", "PREOP", "0")),
        ("engineer", ("clear",)),
        ("engineer", ("rescan",)),
        ("engineer", ("errors", "0")),
    )
    expect_by_role(role, commands, session.ask)


def test_without_a_session_nothing_is_done(daemon: Fake, web: Web, web_command: WebCommand) -> None:
    for cookie in ("", f"ecdaq-{web.port}={WRONG}", f"ecdaq-{web.port}=", "ecdaq-1=a; b"):
        for path in ("/command", "/logout", "/session"):
            status, _, text = post(web, path, f"{WRONG}\nset\n{LED}\n1", Cookie=cookie)
            assert (status, text) == (401, "not logged in, or no longer\n")
    assert json_of(daemon("watch", LED, "--count", "1", "--json"))["values"] == {LED: 0}


def test_the_secret_is_needed_beside_the_cookie(
    daemon: Fake, web: Web, web_command: WebCommand
) -> None:
    session = Session(web, web_command.token("engineer"))
    good = session.secret
    for secret in (WRONG, good[:-1], good + "0", good.upper() if good.upper() != good else "x",
                   session.cookie.partition("=")[2]):  # fmt: skip
        session.secret = secret
        for path in ("/command", "/logout"):
            assert session.ask("set", LED, "1", path=path)[0] == 403
    session.secret = good
    assert session.ask("set", LED, "1")[0] == 200


def test_only_the_page_of_this_server_may_post(
    daemon: Fake, make_web: Callable[..., Web], web_command: WebCommand
) -> None:
    web = make_web(**{"web.origins": "https://app.example"})
    session = Session(web, web_command.token("operator"))
    for origin in (
        "", "null", "https://app.example", f"http://localhost:{web.port}",
        f"http://127.0.0.1:{web.port + 1}", f"https://127.0.0.1:{web.port}",
        f"http://127.0.0.1:{web.port}.evil.example",
    ):  # fmt: skip
        status, text = session.ask("set", LED, "1", Origin=origin)
        assert (status, "Origin" in text) == (403, True), (origin, text)
        token = web_command.token("operator")
        assert post(web, "/login", token, Origin=origin)[0] == 403
        assert post(web, "/login", token)[0] == 200
    evil = {"Host": "evil.example", "Origin": "http://evil.example"}
    assert session.ask("set", LED, "1", **evil)[0] == 403
    assert json_of(daemon("watch", LED, "--count", "1", "--json"))["values"] == {LED: 0}


def test_a_token_is_good_once(web: Web, web_command: WebCommand) -> None:
    token = web_command.token("operator")
    assert re.fullmatch(r"[0-9a-f]{64}", token)
    assert post(web, "/login", token[:-1])[0] == 403
    Session(web, token)
    status, headers, text = post(web, "/login", token)
    assert (status, "no such token" in text, "set-cookie" in headers) == (403, True, False)


def test_wrong_tokens_are_limited_and_a_good_one_still_works(
    web: Web, web_command: WebCommand
) -> None:
    codes = [post(web, "/login", WRONG)[0] for _ in range(14)]
    assert codes == [403] * 10 + [429] * 4
    Session(web, web_command.token("viewer"))
    assert post(web, "/login", WRONG)[0] == 429


def test_the_cookie_is_for_this_page_alone_and_no_script_sees_it(
    web: Web, web_command: WebCommand
) -> None:
    session = Session(web, web_command.token("operator"))
    assert set(session.attributes[1:]) == {"Path=/", "HttpOnly", "SameSite=Strict"}
    assert re.fullmatch(rf"ecdaq-{web.port}=[0-9a-f]{{64}}", session.cookie)
    other = Session(web, web_command.token("operator"))
    assert len({session.cookie, other.cookie, session.secret, other.secret}) == 4
    status, text = session.ask(path="/session")
    assert (status, json.loads(text)) == (200, {"role": "operator", "secret": session.secret})


def test_a_log_out_ends_the_session_at_the_server(
    daemon: Fake, web: Web, web_command: WebCommand
) -> None:
    session = Session(web, web_command.token("operator"))
    other = Session(web, web_command.token("operator"))
    fields = {"Cookie": session.cookie}
    status, headers, _ = post(web, "/logout", session.secret, **fields)
    assert (status, "Max-Age=0" in headers["set-cookie"]) == (200, True)
    assert session.ask("set", LED, "1")[0] == 401
    assert other.ask("set", LED, "1")[0] == 200


def test_log_ins_are_limited_and_a_token_that_found_no_place_stays_good(
    web: Web, web_command: WebCommand
) -> None:
    sessions = [Session(web, web_command.token("viewer")) for _ in range(32)]
    token = web_command.token("viewer")
    status, _, text = post(web, "/login", token)
    assert (status, "log out" in text) == (503, True)
    assert sessions[0].ask(path="/logout")[0] == 200
    assert Session(web, token).role == "viewer"


def test_open_tokens_are_limited(bench: Bench, web_command: WebCommand) -> None:
    assert len({web_command.token("viewer") for _ in range(16)}) == 16
    fails(ecdaq(bench.run_dir, "web-token", "viewer"), REFUSED, "too many tokens")


def test_words_that_are_no_command_are_refused(
    daemon: Fake, web: Web, web_command: WebCommand
) -> None:
    session = Session(web, web_command.token("engineer"))
    for words in (
        (), ("stop",), ("set",), ("set", LED), ("set", LED, "1", "2"), ("set", "--raw", "1"),
        ("set", "-h", "1"), ("set", LED, "1 2"), ("set", f"{LED}=1", "1"), ("state",),
        ("state", "--help"), ("state", "OP", "--force"), ("state", "OP", "piccolo0"),
        ("rescan", "--force"), ("errors", "-1"), ("SET", LED, "1"), ("set", LED, "1", ""),
        ("set", LED, "\x7f"), ("set", LED, "\u00e9"), ("set", LED, "1\r"),
        ("a", "b", "c", "d", "e", "f", "g", "h"), ("set", "a" * 159, "1"),
    ):  # fmt: skip
        status, text = session.ask(*words)
        assert (status, text.count("\n")) == (400, 1), (words, text)
    assert session.ask("set", LED, "1")[0] == 200


def test_hostile_posts_end_in_one_line_and_the_server_goes_on(
    daemon: Fake, web: Web, web_command: WebCommand
) -> None:
    assert post(web, "/command", "x" * 1024)[0] == 413
    assert post(web, "/command", "")[0] == 411
    for length in ("", "-1", "99999999999999999999", "1x", "0x10"):
        assert post(web, "/command", "x", **{"Content-Length": length})[0] in (400, 411, 413)
    assert post(web, "/other", "x")[0] == 405
    assert http(web.port, "PUT /command", body="x", **{"Content-Length": "1"})[0] in (405, 403)
    assert http(web.port, "GET /command")[0] == 404
    # A body with zeros, one that does not come, and one that is longer than it says.
    own = f"Host: 127.0.0.1:{web.port}\r\nOrigin: http://127.0.0.1:{web.port}\r\n"
    for length, body in ((4, b"a\0bc"), (900, b"a"), (1, b"a" * 4000)):
        with socket.create_connection(("127.0.0.1", web.port), timeout=20) as sock:
            head = f"POST /login HTTP/1.1\r\n{own}Content-Length: {length}\r\n\r\n"
            sock.sendall(head.encode() + body)
            answer = b""
            try:
                while part := sock.recv(4096):
                    answer += part
            except ConnectionResetError:
                pass
        assert b" 200 " not in answer
    with pytest.raises(RejectedError):
        WebSocket(web.port, ("ecdaq.page.v1",), path="/command", Host="evil.example")
    session = Session(web, web_command.token("operator"))
    assert session.ask("set", LED, "1")[0] == 200


def test_the_sockets_take_one_whole_request_each(
    bench: Bench, web: Web, web_command: WebCommand
) -> None:
    def ask(name: str, data: bytes) -> bytes:
        with socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET) as sock:
            sock.settimeout(20)
            sock.connect(str(web_command.folder / name))
            sock.send(data)
            try:
                return sock.recv(1 << 16)
            except ConnectionResetError:
                return b""

    good = REQUEST.pack(MAGIC, TOKEN, b"", b"engineer\n10")
    assert len(good) == 1100 and len(ask("token", good)) == REPLY_BYTES
    # A token is for those who may use the other socket.
    assert struct.unpack_from("<II", ask("page", good))[1] == 403
    for data in (b"", b"x", good[:-1], good + b"x", bytes(1100), os.urandom(1100)):
        assert ask("token", data) == b""
        assert ask("page", data) == b""
    for verb in (0, 1, 2, 3, 4, 6, 2**32 - 1):
        answer = ask("token", REQUEST.pack(MAGIC, verb, b"", b"engineer\n10"))
        assert struct.unpack_from("<II", answer)[1] == 403
    for body in (b"", b"root\n10", b"viewer", b"viewer\n0", b"viewer\n1441", b"viewer\n1\n1"):
        answer = ask("token", REQUEST.pack(MAGIC, TOKEN, b"", body))
        assert struct.unpack_from("<II", answer)[1] == 400
    # Many that say nothing use up neither socket for long.
    held = [socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET) for _ in range(30)]
    for sock in held:
        sock.connect(str(web_command.folder / "page"))
    token = web_command.token("viewer")
    for sock in held:
        sock.close()
    assert Session(web, token).role == "viewer"


def test_only_who_may_command_gets_a_token(bench: Bench, web_command: WebCommand) -> None:
    for name in ("token", "page"):
        mode = (web_command.folder / name).stat().st_mode
        assert stat.S_ISSOCK(mode) and stat.S_IMODE(mode) == 0o660
    web_command.folder.chmod(0o755)
    if os.geteuid() == 0:
        result = ecdaq(bench.run_dir, "web-token", "viewer", user=65534)
        fails(result, 4, "no permission to use the socket")


def test_the_verb_reports_its_problems(bench: Bench) -> None:
    fails(ecdaq(bench.run_dir, "web-token", "viewer"), NO_DAEMON, "ecdaq-web-command")
    fails(ecdaq(bench.run_dir, "web-token", "root"), USAGE, "expected viewer, operator or engineer")
    for minutes in ("0", "1441", "x"):
        fails(ecdaq(bench.run_dir, "web-token", "viewer", "--minutes", minutes), USAGE, "minutes")


def test_without_the_other_process_the_answer_is_one_clear_line(web: Web) -> None:
    for path in ("/login", "/logout", "/session", "/command"):
        status, _, text = post(web, path, WRONG)
        assert status == 503
        assert text == "no log-in and no commands: ecdaq-web-command is not running\n"
    assert http(web.port, "GET /")[0] == 200


def test_commands_are_for_the_loopback_only(
    make_web: Callable[..., Web], web_command: WebCommand
) -> None:
    web = make_web(**{"web.listen": "0.0.0.0"})
    status, _, text = post(web, "/login", web_command.token("operator"))
    assert (status, "loopback only" in text) == (403, True)


def test_it_starts_again_and_nobody_is_logged_in_any_more(
    bench: Bench, web: Web, web_command: WebCommand
) -> None:
    session = Session(web, web_command.token("operator"))
    web_command.process.kill()
    web_command.process.wait()
    assert session.ask("set", LED, "1")[0] == 503
    again = WebCommand(bench)
    assert session.ask("set", LED, "1")[0] == 401
    again.stop()
    assert list(again.folder.iterdir()) == []


def test_the_published_client_of_foxglove_gets_no_service_even_with_a_log_in(
    daemon: Fake, web: Web, web_command: WebCommand
) -> None:
    session = Session(web, web_command.token("engineer"))
    folder = npm.install(VIEWER, "@foxglove/ws-protocol")
    shutil.copy(VIEWER / "services.js", folder)
    done = subprocess.run(
        ["node", "services.js", f"ws://127.0.0.1:{web.port}", session.cookie],
        cwd=folder, capture_output=True, text=True, timeout=60, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    assert (found["capabilities"], found["services"]) == (["parameters"], [])
    assert found["responses"] == 0
    assert found["status"]["message"].startswith("a request was ignored")
    assert json_of(daemon("watch", LED, "--count", "1", "--json"))["values"] == {LED: 0}
    # The same log-in may do it where it may.
    assert session.ask("set", LED, "1")[0] == 200


def press(browser: Browser, selector: str) -> None:
    browser.value(f"document.querySelector({selector!r}).click()")


SET = f"""[...document.querySelectorAll('#channel-rows tr')]
  .find((line) => line.children[0].textContent === '{LED}')"""


def test_set_lights_the_led_and_names_the_cycle_in_a_browser(
    daemon: Fake, web: Web, web_command: WebCommand, make_browser: Callable[..., Browser]
) -> None:
    token = web_command.token("operator")
    browser = make_browser(web, f"#token={token}")
    browser.wait_for("document.querySelector('#session-role').textContent === 'operator'")
    # The token is neither in the address nor in the history; no script sees the cookie.
    assert browser.value("[location.hash, history.length, document.cookie]")[::2] == ["", ""]
    history = browser.tell("Page.getNavigationHistory")["entries"]
    assert all(token not in entry["url"] for entry in history[-1:])
    browser.value("location.hash = '#channels'")
    browser.wait_for(f"{SET} !== undefined")
    assert browser.value(f"{SET}.querySelector('form').offsetWidth > 0")
    browser.wait_for(f"{SET}.children[1].textContent === '0'")
    browser.value(f"{SET}.querySelector('select').value = '1'")
    browser.value(f"{SET}.querySelector('form button').click()")
    said = browser.wait_for(f"{SET}.querySelector('[role=status]').textContent.match(/cycle \\d+/)")
    assert int(said[0].split()[1]) >= 1000
    browser.wait_for(f"{SET}.children[1].textContent === '1'")
    assert json_of(daemon("watch", LED, "--count", "1", "--json"))["values"] == {LED: 1}
    # What is refused has its reason in the same place.
    other = SET.replace(LED, "piccolo1.led")
    browser.value(f"{other}.querySelector('form button').click()")
    browser.wait_for(f"{other}.querySelector('[role=status]').textContent.includes('owned by')")
    # A reload keeps the log-in, as the cookie does.
    browser.tell("Page.reload")
    browser.wait_for("document.querySelector('#session-role')?.textContent === 'operator'")
    press(browser, "#session-end")
    browser.wait_for("document.querySelector('#session-role').textContent === ''")
    assert browser.value("!document.querySelector('#session-form').hidden")
    log = web_command.stop()
    assert f"operator 1: set {LED} 1: done" in log and "operator 1 has logged out" in log


def test_an_engineer_leads_a_slave_and_the_bus_in_a_browser(
    daemon: Fake, web: Web, web_command: WebCommand, make_browser: Callable[..., Browser]
) -> None:
    browser = make_browser(web, "#bus?s=0")
    browser.wait_for("!document.querySelector('#bus-slave').hidden")
    visible = (
        "['#bus-commands', '#slave-commands'].map((q) => document.querySelector(q).offsetWidth > 0)"
    )
    assert browser.value(visible) == [False, False]
    # By keyboard: the field, the token, Enter.
    browser.value("document.querySelector('#session-token').focus()")
    browser.tell("Input.insertText", text=web_command.token("engineer"))
    for kind in ("keyDown", "keyUp"):
        browser.tell("Input.dispatchKeyEvent", type=kind, key="Enter", code="Enter", text="\r",
                     windowsVirtualKeyCode=13)  # fmt: skip
    browser.wait_for("document.querySelector('#session-role').textContent === 'engineer'")
    assert browser.value(visible) == [True, True]
    result = "document.querySelector('#bus-result').textContent"
    press(browser, "#slave-commands button")
    assert browser.value(result) == ""  # disabled
    press(browser, "#bus-allow")
    for place, number, done in (
        ("slave", 2, "state PREOP 0: done"),
        ("slave", 5, "errors 0: done"),
        ("bus", 4, "state OP: done"),
        ("bus", 6, "clear: done"),
    ):
        press(browser, f"#{place}-commands button:nth-of-type({number})")
        browser.wait_for(f"{result} === {done!r}")
    axe = npm.install(AXE, "axe-core") / "node_modules" / "axe-core" / "axe.min.js"
    browser.value(axe.read_text() + "; void 0")
    assert browser.value(FOUND) == []
    browser.value("location.hash = '#channels'")
    browser.wait_for(f"{SET} !== undefined")
    assert browser.value(FOUND) == []
    assert browser.problems() == []


def test_a_viewer_and_a_wrong_token_see_no_command_in_a_browser(
    daemon: Fake, web: Web, web_command: WebCommand, make_browser: Callable[..., Browser]
) -> None:
    browser = make_browser(web, f"#token={web_command.token('viewer')}")
    browser.wait_for("document.querySelector('#session-role').textContent === 'viewer'")
    browser.value("location.hash = '#channels'")
    browser.wait_for(f"{SET} !== undefined")
    assert browser.value(f"{SET}.querySelector('form').offsetWidth") == 0
    press(browser, "#session-end")
    browser.wait_for("!document.querySelector('#session-form').hidden")
    browser.value("document.querySelector('#session-token').value = 'x'")
    press(browser, "#session-form button")
    browser.wait_for(
        "document.querySelector('#session-note').textContent.includes('no such token')"
    )
