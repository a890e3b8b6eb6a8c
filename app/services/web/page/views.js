// SPDX-License-Identifier: MIT
// The views State and Channels.
import { load_options, outputs_of } from "./config.js";
import { format } from "./picture.js";
import { button, row, set_level, set_text } from "./table.js";

const by_id = (id) => document.getElementById(id);

export class StateView {
  show(state) {
    set_text(by_id("word"), state.word);
    set_level(by_id("word"), state.level);
    set_text(by_id("sentence"), state.sentence);
    const rows = by_id("rows");
    while (rows.children.length > state.rows.length) {
      rows.lastChild.remove();
    }
    state.rows.forEach(({ name, value, level }, i) => {
      const line = rows.children[i] ?? rows.appendChild(row("", ""));
      set_text(line.children[0], name);
      set_text(line.children[1], value);
      set_level(line.children[1], level);
    });
  }
}

// A field and a button that set an output, and what came of it.
function setter(channel, command) {
  const form = document.createElement("form");
  const field = document.createElement(channel.binary ? "select" : "input");
  const note = document.createElement("span");
  if (channel.binary) {
    field.append(new Option("off", "0"), new Option("on", "1"));
  } else {
    field.required = true;
    field.inputMode = "decimal";
    field.autocomplete = "off";
  }
  field.setAttribute("aria-label", `${channel.name}: new value`);
  note.setAttribute("role", "status");
  const set = document.createElement("button");
  set.textContent = "Set";
  set.setAttribute("aria-label", `set ${channel.name}`);
  form.append(field, " ", set, " ", note);
  form.addEventListener("submit", async (event) => {
    event.preventDefault();
    const wanted = field.value.trim();
    note.textContent = "…";
    const { ok, text } = await command("set", channel.name, wanted);
    note.textContent = ok ? `${wanted} from cycle ${JSON.parse(text).cycle} on` : text;
    set_level(note, ok ? "good" : "bad");
  });
  return form;
}

export class ChannelsView {
  // on_scope(index) shows a channel; command(...words) is of the session.
  constructor(on_scope, command) {
    this.on_scope = on_scope;
    this.command = command;
    this.lines = [];
    by_id("channel-filter").addEventListener("input", () => this.filter());
  }

  set_table(table) {
    this.lines = table.channels.map((channel, i) => {
      const line = row(channel.name, "", channel.unit, "", button("+", `${channel.name} in the scope`, () => this.on_scope(i)));
      line.children[1].className = "number";
      line.insertCell();
      const place = line.insertCell();
      place.className = "for-operator";
      if (channel.output) {
        place.append(setter(channel, this.command));
      }
      return line;
    });
    this.names = table.channels.map((channel) => channel.name.toLowerCase());
    this.outputs = table.channels.map((channel) => channel.output);
    by_id("channel-rows").replaceChildren(...this.lines);
    this.filter();
    this.show_owners();
  }

  // Who may write each output, and what it is limited to, by the configuration.
  async load() {
    try {
      this.owners = outputs_of(await load_options());
    } catch {
      return; // the view Configuration says why; it is read again when this view is opened
    }
    this.show_owners();
  }

  show_owners() {
    this.lines.forEach((line, i) => {
      if (this.outputs[i] && this.owners) {
        const { owner, min, max, fail_safe } = this.owners.get(line.children[0].textContent) ?? { owner: "local" };
        const limits = min === "-inf" && max === "inf" ? [] : [`${min} to ${max}`];
        const all = [owner, ...(min === undefined ? [] : [...limits, `fail-safe ${fail_safe}`])];
        set_text(line.children[5], all.join("; "));
      }
    });
  }

  filter() {
    const wanted = by_id("channel-filter").value.toLowerCase();
    this.lines.forEach((line, i) => {
      line.hidden = !this.names[i].includes(wanted);
    });
  }

  show({ cycle, values }) {
    set_text(by_id("channel-cycle"), `cycle ${cycle}`);
    values.forEach((value, i) => {
      const cells = this.lines[i]?.children;
      if (cells) {
        set_text(cells[1], format(value));
        set_text(cells[3], value === null ? "not good" : "good");
        set_level(cells[3], value === null ? "bad" : "good");
      }
    });
  }
}
