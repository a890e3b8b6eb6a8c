// SPDX-License-Identifier: MIT
// The view Scope: what is asked of the server, and the controls.
import { Analysis } from "./analysis.js";
import { draw, plot_area } from "./chart.js";
import { Gestures } from "./gestures.js";
import { format_seconds } from "./picture.js";
import { save_as, save_recording } from "./save.js";
import { ScopeTable, list_events } from "./scope_table.js";
import { set_text } from "./table.js";
import { Trigger } from "./trigger.js";

const CHANNELS = 8; // the server's limit
const WINDOWS_S = [0.001, 0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 30, 60, 120, 300, 600, 1200, 1800, 3600, 7200,
  21600, 43200, 86400];
const REDRAW_MS = 40;
const ANALYSIS_MS = 400;
const EVENTS = 500; // as many as the server keeps
const CYCLES = 2 ** 27; // the server's limit
const PIXELS = 2000;

const by_id = (id) => document.getElementById(id);

export class Scope {
  constructor(send) {
    this.send = send;
    this.table = { channels: [], period_ns: 1e6 };
    this.names = []; // of the channels that are shown
    this.window_s = 2;
    this.end = 0; // 0: live
    this.is_visible = false;
    this.is_asked = false;
    this.request = 0;
    this.picture = null;
    this.cursors = null; // two cycles
    this.rows = new ScopeTable({
      on_scale: () => {
        this.restart();
        this.redraw();
      },
      on_remove: (name) => this.remove(name),
    });
    this.events = [];
    this.canvas = by_id("scope-canvas");
    this.trigger = new Trigger(() => this.go_live());
    this.analysis = new Analysis(() => this.restart());
    this.gestures = new Gestures(this, this.canvas);
    for (const seconds of WINDOWS_S) {
      const name = seconds < 3600 ? format_seconds(seconds) : `${seconds / 3600} h`;
      by_id("scope-window").append(new Option(name, seconds));
    }
    this.read_hash();
    this.listen();
  }

  listen() {
    const on = (id, type, act) => by_id(id).addEventListener(type, act);
    on("scope-add", "input", () => {
      this.add(Number(by_id("scope-add").value));
      by_id("scope-add").value = "";
    });
    on("scope-window", "input", () => this.zoom_to(Number(by_id("scope-window").value)));
    on("scope-pause", "click", () => this.pause());
    on("scope-back", "click", () => this.move(-0.5));
    on("scope-forward", "click", () => this.move(0.5));
    on("scope-live", "click", () => this.go_live());
    on("scope-cursors", "click", () => this.show_cursors());
    on("scope-save", "input", () => this.save());
    new ResizeObserver(() => this.redraw()).observe(this.canvas);
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => {
      this.redraw();
      this.analysis.draw();
    });
  }

  period_s() {
    return this.table.period_ns / 1e9;
  }

  cycles() {
    return Math.min(Math.max(1, Math.round(this.window_s / this.period_s())), CYCLES);
  }

  index_of(name) {
    return this.table.channels.findIndex((channel) => channel.name === name);
  }

  set_table(table) {
    if (this.table.session !== undefined && this.table.session !== table.session) {
      this.end = 0; // cycles of the session before are not in the ring any more
    }
    this.table = table.period_ns > 0 ? table : { channels: [], period_ns: 1e6 };
    this.picture = null;
    const options = () => this.table.channels.map((channel, i) => new Option(channel.name, i));
    by_id("scope-add").replaceChildren(new Option("add…", ""), ...options());
    if (this.table.channels.length > 0) {
      this.choose_channels();
    }
    this.trigger.set_channels(options(), (name) => this.index_of(name));
    this.show_rows();
    this.restart();
  }

  // Those of the address, as far as there are such.
  choose_channels() {
    this.names = this.names.filter((name) => this.index_of(name) >= 0);
    if (this.names.length === 0) {
      // Something to look at: the first values with a unit, else the first ones.
      const inputs = this.table.channels.filter((channel) => !channel.output);
      const scaled = inputs.filter((channel) => channel.unit !== "");
      this.names = (scaled.length > 0 ? scaled : inputs).slice(0, 2).map((channel) => channel.name);
    }
    this.trigger.name ??= this.names[0];
  }

  add(index) {
    const name = this.table.channels[index]?.name;
    if (name && !this.names.includes(name) && this.names.length < CHANNELS) {
      this.names.push(name);
      this.show_rows();
      this.restart();
    }
  }

  remove(name) {
    this.names = this.names.filter((other) => other !== name);
    this.show_rows();
    this.restart();
  }

  // A new connection or other settings: whatever was asked before is not waited for.
  restart() {
    this.is_asked = false;
    this.ask();
  }

  set_visible(is_visible) {
    this.is_visible = is_visible;
    this.restart();
  }

  is_live() {
    return this.end === 0;
  }

  ask() {
    if (!this.is_visible || this.is_asked || this.table.channels.length === 0) {
      return;
    }
    if (location.hash === this.address && this.address !== this.hash()) { // else it is read soon
      history.replaceState(null, "", this.hash());
      this.address = location.hash;
    }
    const trigger = this.trigger.request(this.cycles(), this.period_s(), this.triggered);
    this.asked_ms = performance.now();
    this.send_draw({
      cycles: this.cycles(), pixels: this.pixels(), end: this.end, ...trigger,
      edge: this.is_live() && !this.is_without_trigger ? trigger.edge : "none",
    });
  }

  send_draw(request) {
    const channels = this.names.map((name) => this.index_of(name));
    this.is_asked = true;
    this.send({ op: "draw", id: ++this.request, channels, ...request });
  }

  // The samples below the picture that was shown last, if it is time for them.
  ask_samples() {
    const now = performance.now();
    if (!this.analysis.is_on() || !this.picture || (this.is_live() && now - this.samples_ms < ANALYSIS_MS)) {
      return false;
    }
    const cycles = this.analysis.cycles(this.picture.cycles);
    this.samples_ms = now;
    this.samples_id = this.request + 1;
    this.send_draw({ cycles, pixels: cycles, end: this.picture.first + this.picture.cycles, edge: "none" });
    return true;
  }

  pixels() {
    return Math.min(Math.max(plot_area(this.canvas.clientWidth, 100).width, 100), PIXELS) | 0;
  }

  // A picture, or why there is none.
  take(message) {
    if (message.id !== this.request) {
      return;
    }
    this.is_asked = false;
    if (message.id === this.samples_id) {
      if (message.op === "picture") {
        this.analysis.take(message, this.channels_of(message), this.period_s());
      }
    } else {
      this.take_picture(message);
      if (message.op === "picture" && !this.is_asked && this.ask_samples()) {
        return;
      }
    }
    if (this.is_live()) {
      const wait = Math.max(REDRAW_MS - (performance.now() - this.asked_ms), 0);
      clearTimeout(this.timer);
      this.timer = setTimeout(() => this.ask(), wait);
    }
  }

  take_picture(message) {
    const mode = this.trigger.mode();
    if (message.op === "picture") {
      this.is_without_trigger = false;
      this.picture = message;
      this.triggered = message.trigger ?? this.triggered; // stays the zero of time when it is paused
      set_text(by_id("scope-note"), this.note());
      this.redraw();
      if (message.trigger !== undefined && mode === "single") {
        this.pause();
      }
    } else {
      set_text(by_id("scope-note"), message.why);
      // Automatic: without a trigger the newest samples are shown.
      this.is_without_trigger = message.why === "no trigger" && mode === "auto";
    }
  }

  channels_of(picture) {
    return picture.channels.map((index) => this.table.channels[index]);
  }

  note() {
    const missing = this.picture.marks.filter((mark) => mark & 1).length;
    const where = this.is_live() ? "live" : `paused, up to cycle ${this.picture.first + this.picture.cycles - 1}`;
    return `${where}${this.picture.trigger === undefined ? "" : `, trigger at cycle ${this.picture.trigger}`}` +
      `${missing > 0 ? `, cycles without a sample in ${missing} columns` : ""}`;
  }

  zero() {
    const { first, cycles, trigger } = this.picture;
    const kept = !this.is_live() && this.triggered >= first && this.triggered <= first + cycles;
    return trigger ?? (kept ? this.triggered : first + cycles);
  }

  // What the chart needs beside the picture.
  options() {
    const shown = this.channels_of(this.picture);
    const style = getComputedStyle(this.canvas);
    return {
      units: shown.map((channel) => channel.unit),
      colours: shown.map((_, i) => `--c${i}`),
      colour: (name) => style.getPropertyValue(name).trim(),
      period_s: this.period_s(),
      zero: this.zero(),
      scales: shown.map(({ name }) => this.rows.scale_of(name)),
      cursors: (this.cursors ?? []).map((cycle, n) => ({ name: "AB"[n], cycle })),
      levels: { index: this.picture.channels.indexOf(this.trigger.channel()), values: this.trigger.levels() },
      events: this.shown_events(),
    };
  }

  redraw() {
    if (this.picture && this.is_visible) {
      draw(this.canvas, this.picture, this.options());
      this.rows.show_numbers(this.picture, this.cursors, this.period_s());
      list_events(this.shown_events(), this.zero(), this.period_s());
    }
  }

  add_events(events) {
    this.events.push(...events);
    this.events.splice(0, this.events.length - EVENTS);
  }

  shown_events() {
    const { first, cycles } = this.picture;
    return this.events.filter(({ cycle }) => cycle >= first && cycle < first + cycles);
  }

  save() {
    const kind = by_id("scope-save").value;
    by_id("scope-save").value = "";
    if (!this.picture || kind === "") {
      return;
    }
    if (kind === "mcap") {
      save_recording(this.picture, this.table, this.is_live());
      return;
    }
    save_as(kind, this.canvas, this.picture, { ...this.options(), channels: this.channels_of(this.picture) });
  }

  show_rows() {
    this.rows.show_rows(this.names, (name) => this.table.channels[this.index_of(name)]?.unit ?? "");
  }

  // The end of what is shown, as a cycle.
  shown_end() {
    return this.is_live() && this.picture ? this.picture.first + this.picture.cycles : this.end;
  }

  freeze(end) {
    this.end = Math.max(Math.round(end), this.cycles());
    by_id("scope-pause").setAttribute("aria-pressed", "true");
    this.restart();
  }

  pause() {
    if (!this.is_live()) {
      this.go_live();
    } else if (this.picture) {
      this.freeze(this.shown_end());
    }
  }

  go_live() {
    this.end = 0;
    this.triggered = undefined;
    this.is_without_trigger = false;
    by_id("scope-pause").setAttribute("aria-pressed", "false");
    this.restart();
  }

  move(windows) {
    if (this.picture) {
      this.freeze(this.shown_end() + windows * this.cycles());
    }
  }

  show_cycle(cycle) {
    this.freeze(cycle + this.cycles() / 2);
  }

  // @part: the place in the picture that stays, from 0 on the left to 1.
  zoom_to(seconds, part = 0.5) {
    const kept = this.shown_end() - this.cycles() * (1 - part);
    this.window_s = seconds;
    by_id("scope-window").value = String(seconds);
    if (!this.is_live()) {
      this.end = Math.max(Math.round(kept + this.cycles() * (1 - part)), this.cycles());
    }
    this.restart();
  }

  zoom(steps, part = 0.5) {
    const place = WINDOWS_S.indexOf(this.window_s) + steps;
    if (place >= 0 && place < WINDOWS_S.length) {
      this.zoom_to(WINDOWS_S[place], part);
    }
  }

  show_cursors() {
    const { first, cycles } = this.picture ?? {};
    this.cursors = this.cursors || !this.picture ? null : [first + cycles / 4, first + (3 * cycles) / 4].map(Math.round);
    by_id("scope-cursors").setAttribute("aria-pressed", String(this.cursors !== null));
    if (this.cursors && this.is_live()) {
      this.pause(); // cursors measure what stands still
    }
    this.redraw();
  }

  move_cursor(n, direction) {
    if (this.cursors) {
      this.cursors[n] += direction * Math.max(1, Math.round(this.cycles() / this.pixels()));
      this.redraw();
    }
  }

  // Where the cursors are in the picture, from 0 on the left to 1.
  cursor_parts() {
    return (this.cursors ?? []).map((cycle) => (cycle - this.picture.first) / this.picture.cycles);
  }

  set_cursor(n, part) {
    this.cursors[n] = Math.round(this.picture.first + Math.min(Math.max(part, 0), 1) * this.picture.cycles);
    this.redraw();
  }

  // The settings, so that a view can be sent to a colleague.
  hash() {
    const fields = new URLSearchParams({
      c: this.names.join(","), w: this.window_s, ...this.trigger.fields((index) => this.table.channels[index]?.name),
      ...this.rows.fields(this.names),
      ...(this.analysis.is_on() ? this.analysis.fields() : {}), ...(this.is_live() ? {} : { end: this.end }),
    });
    return `#scope?${fields}`;
  }

  read_hash() {
    this.address = location.hash;
    const [view, text] = location.hash.slice(1).split("?");
    if (view === "scope" && text) {
      const fields = new URLSearchParams(text);
      const window_s = Number(fields.get("w"));
      this.names = (fields.get("c") ?? "").split(",").filter((name) => name !== "").slice(0, CHANNELS);
      this.window_s = WINDOWS_S.includes(window_s) ? window_s : this.window_s;
      this.rows.read(this.names, fields);
      this.trigger.read(fields);
      this.analysis.read(fields);
      this.end = Number(fields.get("end")) || 0;
      if (this.table.channels.length > 0) {
        this.names = this.names.filter((name) => this.index_of(name) >= 0);
        this.show_rows();
        this.restart();
      }
    }
    by_id("scope-window").value = String(this.window_s);
  }
}
