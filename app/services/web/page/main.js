// SPDX-License-Identifier: MIT
import { BusView } from "./bus.js";
import { ConfigView } from "./config.js";
import { Doctor } from "./doctor.js";
import { EventsView } from "./events.js";
import { Link } from "./link.js";
import { RecordingsView } from "./recordings.js";
import { Scope } from "./scope.js";
import { Session } from "./session.js";
import { set_level, set_text } from "./table.js";
import { ChannelsView, StateView } from "./views.js";

const VIEWS = ["state", "bus", "channels", "events", "recordings", "scope", "config"];
const lamp = document.getElementById("lamp");

const session = new Session();
const command = (...words) => session.command(...words);
const state = new StateView();
const bus = new BusView((position) => {
  location.hash = `bus?s=${position}`;
}, command);
const config = new ConfigView();
const doctor = new Doctor();
const recordings = new RecordingsView();
const scope = new Scope((request) => link.send(request));
const channels = new ChannelsView((channel) => {
  scope.add(channel);
  location.hash = scope.hash();
}, command);
const events = new EventsView({
  on_scope: (cycle) => {
    scope.show_cycle(cycle);
    location.hash = scope.hash();
  },
});

function view() {
  const name = location.hash.slice(1).split("?")[0];
  return VIEWS.includes(name) ? name : "state";
}

let shown = ""; // what is read once is read when its view opens

function show_view() {
  for (const name of VIEWS) {
    document.getElementById(`view-${name}`).hidden = name !== view();
    const anchor = document.querySelector(`nav a[href="#${name}"]`);
    if (name === view()) {
      anchor.setAttribute("aria-current", "page");
    } else {
      anchor.removeAttribute("aria-current");
    }
  }
  bus.read_place(view() === "bus" ? (location.hash.split("?")[1] ?? "") : "");
  link.send({ op: "bus", on: view() === "bus", ...bus.request() });
  link.send({ op: "values", on: view() === "channels" });
  link.send({ op: "folds", on: view() === "events" });
  link.send({ op: "recordings", on: view() === "recordings" });
  scope.set_visible(view() === "scope");
  if (shown !== view()) {
    shown = view();
    if (shown === "config") {
      config.load();
    } else if (shown === "state") {
      doctor.load();
    } else if (shown === "channels") {
      channels.load();
    }
  }
}

function on_message(message) {
  switch (message.op) {
    case "table":
      channels.set_table(message);
      events.set_table(message);
      scope.set_table(message);
      break;
    case "state":
      set_text(lamp, message.word);
      set_level(lamp, message.level);
      state.show(message);
      break;
    case "bus":
      bus.show(message);
      break;
    case "slave":
      bus.show_slave(message);
      break;
    case "values":
      channels.show(message);
      break;
    case "recordings":
      recordings.show(message);
      break;
    case "events":
      events.add(message.events);
      scope.add_events(message.events);
      break;
    case "folds":
      events.set_folds(message);
      break;
    case "picture":
    case "nopicture":
      scope.take(message);
      break;
  }
}

function on_change(is_open) {
  if (is_open) {
    events.clear(); // all that are kept are sent again
    scope.events = [];
    scope.restart();
    show_view();
  } else {
    set_text(lamp, "no connection");
    set_level(lamp, "bad");
  }
}

const link = new Link(on_message, on_change);
addEventListener("hashchange", () => {
  scope.read_hash();
  show_view();
});
show_view();
