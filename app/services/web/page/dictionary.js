// SPDX-License-Identifier: MIT
// The object dictionary of one slave, read by SDO while it is open. A mailbox is slow and serves
// others, too: one exchange at a time, and few a second.
import { decode, is_number_type } from "./object_value.js";
import { button, row, set_level, set_text } from "./table.js";

const by_id = (id) => document.getElementById(id);

const REFUSED = 409;
const GONE = 401;
const EXCHANGE_MS = 220; // ecdaq-web-command permits one in 200
const REFUSED_MS = 10000; // what a slave has refused is asked for again after this time
const OBJECT_EXCHANGES = 5; // the object and four of its entries
const ENTRIES_AT_A_TIME = 4;

const hex = (value, digits) => `0x${value.toString(16).padStart(digits, "0")}`;
const place_of = (index, subindex) => `${hex(index, 4)}:${subindex.toString(16).padStart(2, "0")}`;
const wait = (ms) => new Promise((done) => setTimeout(done, ms));
// What the tool says of it; the part of the answer before that is no answer.
const reason = (text) => text.split("\n").find((line) => line.startsWith("ecdaq: ")) ?? text;
const may_read = () => ["operator", "engineer"].includes(document.body.dataset.role);

// One entry of an object: its row, and the value that is read again and again.
class Entry {
  constructor(index, { subindex, name, type, bits, access }, write) {
    this.place = place_of(index, subindex);
    this.type = type;
    this.again_ms = 0;
    this.readable = access.slice(0, 3).includes("r");
    this.line = row(this.place, name, `${type}, ${bits} bit`, access, this.readable ? "…" : "not readable");
    this.value = this.line.children[4];
    const cell = this.line.insertCell();
    cell.className = "for-engineer";
    if (access.slice(3).includes("w") && is_number_type(type)) {
      cell.append(this.writer(write));
    }
  }

  writer(write) {
    const form = document.createElement("form");
    const field = document.createElement("input");
    const note = document.createElement("span");
    const button = document.createElement("button");
    field.required = true;
    field.autocomplete = "off";
    field.setAttribute("aria-label", `${this.place}: new value`);
    note.setAttribute("role", "status");
    button.textContent = "Write";
    button.setAttribute("aria-label", `write ${this.place}`);
    form.append(field, " ", button, " ", note);
    form.addEventListener("submit", async (event) => {
      event.preventDefault();
      const wanted = field.value.trim();
      set_text(note, "…");
      const { ok, text } = await write(this.type, this.place, wanted);
      set_text(note, ok ? `${wanted} written` : reason(text));
      set_level(note, ok ? "good" : "bad");
    });
    return form;
  }

  show({ ok, text }) {
    set_text(this.value, ok ? decode(this.type, JSON.parse(text).bytes) : reason(text));
    set_level(this.value, ok ? "" : "bad");
    this.again_ms = ok ? 0 : performance.now() + REFUSED_MS;
  }
}

class DictionaryObject {
  constructor(index, write) {
    this.index = index;
    this.write = write;
    this.next = 0; // the subindex that is asked for next; above 255: all is known
    this.entries = [];
    this.is_open = false;
    this.button = button(`${hex(index, 4)}`, `object ${hex(index, 4)}`, () => this.turn());
    this.button.setAttribute("aria-expanded", "false");
    this.line = row(this.button, "", "", "", "");
    this.line.insertCell().className = "for-engineer";
    this.line.className = "object";
  }

  turn() {
    this.is_open = !this.is_open;
    this.button.setAttribute("aria-expanded", String(this.is_open));
    this.show_entries();
  }

  show_entries() {
    for (const { line } of this.entries) {
      line.hidden = !this.is_open || this.line.hidden;
    }
  }

  matches(wanted) {
    return `${hex(this.index, 4)} ${this.line.children[1].textContent}`.toLowerCase().includes(wanted);
  }

  describe({ ok, text }) {
    if (!ok) {
      set_text(this.line.children[2], reason(text));
      set_level(this.line.children[2], "bad");
      this.next = Infinity;
      return;
    }
    const { name, code, last, entry } = JSON.parse(text);
    set_text(this.line.children[1], name);
    set_text(this.line.children[2], code);
    let before = this.entries.at(-1)?.line ?? this.line;
    for (const found of entry) {
      const made = new Entry(this.index, found, this.write);
      before.after(made.line);
      before = made.line;
      this.entries.push(made);
    }
    this.next += ENTRIES_AT_A_TIME;
    this.next = this.next > last ? Infinity : this.next;
    this.show_entries();
  }
}

export class Dictionary {
  // command(...words) is of the session.
  constructor(command) {
    this.command = command;
    this.slave = "";
    this.run_number = 0; // a run whose number is another one has ended
    by_id("objects-open").addEventListener("click", () => (this.is_open() ? this.close() : this.open()));
    by_id("objects-filter").addEventListener("input", () => this.filter());
    this.close();
  }

  is_open() {
    return by_id("objects-open").getAttribute("aria-expanded") === "true";
  }

  // Of the slave at this position, which is the one that @key says; NaN: of none.
  choose(position, key) {
    const slave = Number.isNaN(position) ? "" : `${position} ${key}`;
    if (slave !== this.slave) {
      this.slave = slave;
      this.position = String(position);
      this.close();
    }
    by_id("bus-objects").hidden = slave === "";
  }

  close() {
    this.run_number++;
    by_id("objects-open").setAttribute("aria-expanded", "false");
    by_id("objects").hidden = true;
    by_id("objects-rows").replaceChildren();
    this.note("");
  }

  open() {
    by_id("objects-open").setAttribute("aria-expanded", "true");
    by_id("objects").hidden = false;
    this.run(++this.run_number);
  }

  note(text, level = "") {
    set_text(by_id("objects-note"), text);
    set_level(by_id("objects-note"), level);
  }

  // Nobody looks. Without the role for it this run ends.
  must_wait() {
    if (!may_read()) {
      this.close();
    }
    return document.hidden || !this.is_open();
  }

  // The answer to a command to the mailbox, when it is its turn; undefined: this run has ended.
  async ask(number, exchanges, ...words) {
    while (number === this.run_number) {
      if (this.must_wait()) {
        await wait(EXCHANGE_MS);
        continue;
      }
      const answer = await this.command(...words);
      await wait(exchanges * EXCHANGE_MS);
      if (number !== this.run_number) {
        return undefined;
      }
      if (answer.status === GONE) {
        this.close();
        return undefined;
      }
      if (answer.ok || answer.status === REFUSED) {
        return answer;
      }
      this.note(answer.status === 429 ? "" : answer.text, "warning"); // it is another one's turn
    }
    return undefined;
  }

  async run(number) {
    const indices = await this.read_indices(number);
    if (!indices) {
      return;
    }
    const write = (type, place, value) => this.ask(number, 1, "write", type, this.position, place, value)
      .then((answer) => answer ?? { ok: false, text: "not written" });
    const objects = indices.map((index) => new DictionaryObject(index, write));
    this.objects = objects;
    by_id("objects-rows").replaceChildren(...objects.map(({ line }) => line));
    this.note(`${objects.length} objects`);
    this.filter();
    while (number === this.run_number) {
      const first = this.object_to_describe();
      const entry = this.entry_to_read();
      if (first) {
        const answer = await this.ask(number, OBJECT_EXCHANGES, "object", this.position, place_of(first.index, first.next));
        if (answer) {
          first.describe(answer);
          this.filter();
        }
      }
      if (entry) {
        const answer = await this.ask(number, 1, "read", this.position, entry.place);
        answer && entry.show(answer);
      }
      if (!first && !entry) {
        this.must_wait();
        await wait(EXCHANGE_MS);
      }
    }
  }

  async read_indices(number) {
    const indices = [];
    for (let from = 1, left = 1; left > 0; from = indices.at(-1) + 1) {
      this.note("…");
      const answer = await this.ask(number, 1, "objects", this.position, hex(from, 4));
      if (!answer?.ok) {
        answer && this.note(reason(answer.text), "bad");
        return undefined;
      }
      const found = JSON.parse(answer.text);
      indices.push(...found.indices);
      left = found.indices.length ? found.left : 0;
    }
    return indices;
  }

  // Those that are open first; of the others the names.
  object_to_describe() {
    const seen = this.objects.filter(({ line }) => !line.hidden);
    return seen.find((o) => o.is_open && o.next < Infinity) ?? seen.find((o) => o.next === 0);
  }

  // In turn, those whose rows are seen.
  entry_to_read() {
    const is_due = (e) => e.readable && !e.line.hidden && e.again_ms <= performance.now();
    const all = this.objects.flatMap((o) => (o.is_open ? o.entries.filter(is_due) : []));
    this.turn = ((this.turn ?? -1) + 1) % Math.max(all.length, 1);
    return all[this.turn];
  }

  filter() {
    const wanted = by_id("objects-filter").value.trim().toLowerCase();
    for (const object of this.objects ?? []) {
      object.line.hidden = !object.matches(wanted);
      object.show_entries();
    }
  }
}
