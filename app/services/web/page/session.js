// SPDX-License-Identifier: MIT
// Log-in by a token, the role, and commands. The name of the session is in a cookie that no script
// sees; its secret is here only, and with each request.
const by_id = (id) => document.getElementById(id);

const GONE = 401;
// Whether this browser has logged in: else the server is not asked for a session.
const MARK = "ecdaq-session";

// The token of an address "#token=...", which is taken out of the address and of the history.
function take_token() {
  const found = /^#token=([0-9a-f]{64})$/.exec(location.hash);
  if (found) {
    history.replaceState(null, "", location.pathname);
  }
  return found?.[1];
}

async function post(path, lines) {
  try {
    const answer = await fetch(path, { method: "POST", body: lines.join("\n") });
    return { status: answer.status, ok: answer.ok, text: (await answer.text()).trim() };
  } catch {
    return { status: 0, ok: false, text: "no connection" };
  }
}

export class Session {
  constructor() {
    this.secret = "";
    by_id("session-form").addEventListener("submit", (event) => {
      event.preventDefault();
      this.log_in(by_id("session-token").value.trim());
    });
    by_id("session-end").addEventListener("click", () => this.log_out());
    this.begin();
  }

  async begin() {
    const token = take_token();
    if (token) {
      await this.log_in(token);
    } else if (localStorage.getItem(MARK)) {
      this.take(await post("/session", ["?"]));
    } else {
      this.show("");
    }
  }

  async log_in(token) {
    by_id("session-token").value = "";
    const answer = await post("/login", [token || "?"]);
    this.take(answer);
    by_id("session-note").textContent = answer.ok ? "" : answer.text;
  }

  async log_out() {
    await post("/logout", [this.secret]);
    this.forget();
  }

  // What a log-in is answered with.
  take(answer) {
    if (!answer.ok) {
      this.forget();
      return;
    }
    const { role, secret } = JSON.parse(answer.text);
    this.secret = secret;
    localStorage.setItem(MARK, "1");
    this.show(role);
  }

  forget() {
    this.secret = "";
    localStorage.removeItem(MARK);
    this.show("");
  }

  // What a role may not do is not shown: style.css.
  show(role) {
    document.body.dataset.role = role;
    by_id("session-role").textContent = role;
    by_id("session-form").hidden = role !== "";
    by_id("session-end").hidden = role === "";
  }

  // {ok, text}: what was printed, or why it was refused.
  async command(...words) {
    const answer = await post("/command", [this.secret, ...words]);
    if (answer.status === GONE) {
      this.forget();
    }
    return answer;
  }
}
