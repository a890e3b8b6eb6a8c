// SPDX-License-Identifier: MIT
// Mouse, wheel, touch and keys on the scope's canvas. What they do is the scope's.
import { plot_area } from "./chart.js";

const GRAB_PIXELS = 12; // so near to a cursor it is taken, not the picture
const WHEEL_PIXELS = 40; // for one step of zoom or a sixteenth of the window

export class Gestures {
  constructor(scope, canvas) {
    this.scope = scope;
    this.canvas = canvas;
    this.pointers = new Map();
    this.wheel = 0;
    canvas.addEventListener("keydown", (event) => this.key(event));
    canvas.addEventListener("wheel", (event) => this.turn(event), { passive: false });
    canvas.addEventListener("pointerdown", (event) => this.press(event));
    canvas.addEventListener("pointermove", (event) => this.move(event));
    for (const type of ["pointerup", "pointercancel"]) {
      canvas.addEventListener(type, (event) => this.release(event));
    }
  }

  key(event) {
    const { scope } = this;
    const acts = {
      " ": () => scope.pause(), "+": () => scope.zoom(-1), "-": () => scope.zoom(1),
      ArrowLeft: () => scope.move(-0.25), ArrowRight: () => scope.move(0.25),
      PageUp: () => scope.move(-1), PageDown: () => scope.move(1), l: () => scope.go_live(),
      c: () => scope.show_cursors(), "[": () => scope.move_cursor(0, -1), "]": () => scope.move_cursor(0, 1),
      "{": () => scope.move_cursor(1, -1), "}": () => scope.move_cursor(1, 1),
    };
    const act = acts[event.key] ?? acts[event.key.toLowerCase()];
    if (act && !event.ctrlKey && !event.altKey && !event.metaKey) {
      event.preventDefault();
      act();
    }
  }

  // The place in the plot, from 0 on the left to 1.
  part(x) {
    const area = plot_area(this.canvas.clientWidth, this.canvas.clientHeight);
    return (x - area.x) / area.width;
  }

  // Up and down zooms around the pointer; sideways, or with the shift key, moves.
  turn(event) {
    event.preventDefault();
    const lines = event.deltaMode === WheelEvent.DOM_DELTA_LINE ? 16 : 1;
    const is_sideways = event.shiftKey || Math.abs(event.deltaX) > Math.abs(event.deltaY);
    this.wheel += lines * (is_sideways ? event.deltaX || event.deltaY : event.deltaY);
    const steps = Math.trunc(this.wheel / WHEEL_PIXELS);
    if (steps !== 0) {
      this.wheel -= steps * WHEEL_PIXELS;
      is_sideways ? this.scope.move(steps / 16) : this.scope.zoom(Math.sign(steps), this.part(event.offsetX));
    }
  }

  press(event) {
    this.pointers.set(event.pointerId, event.offsetX);
    this.canvas.setPointerCapture(event.pointerId);
    this.start = {
      part: this.part(event.offsetX), end: this.scope.shown_end(), spread: this.spread(),
      cursor: this.cursor_near(event.offsetX),
    };
  }

  cursor_near(x) {
    const cursors = this.scope.cursor_parts();
    const area = plot_area(this.canvas.clientWidth, this.canvas.clientHeight);
    const distances = cursors.map((part) => Math.abs(part - this.part(x)) * area.width);
    const n = distances.indexOf(Math.min(...distances));
    return n >= 0 && distances[n] <= GRAB_PIXELS ? n : -1;
  }

  // Pixels between two fingers; 0: there are not two.
  spread() {
    const [a, b] = [...this.pointers.values()];
    return b === undefined ? 0 : Math.max(Math.abs(a - b), 1);
  }

  move(event) {
    if (!this.pointers.has(event.pointerId)) {
      return;
    }
    this.pointers.set(event.pointerId, event.offsetX);
    if (this.pointers.size === 2) {
      this.pinch();
    } else if (this.start.cursor >= 0) {
      this.scope.set_cursor(this.start.cursor, this.part(event.offsetX));
    } else if (this.scope.picture && this.part(event.offsetX) !== this.start.part) {
      this.scope.freeze(this.start.end - (this.part(event.offsetX) - this.start.part) * this.scope.cycles());
    }
  }

  pinch() {
    const ratio = this.spread() / this.start.spread;
    if (this.start.spread > 0 && (ratio > 1.6 || ratio < 0.625)) {
      const [a, b] = [...this.pointers.values()];
      this.scope.zoom(ratio > 1 ? -1 : 1, this.part((a + b) / 2));
      this.start.spread = this.spread();
    }
  }

  release(event) {
    this.pointers.delete(event.pointerId);
    for (const x of this.pointers.values()) {
      this.start = { part: this.part(x), end: this.scope.shown_end(), spread: 0, cursor: -1 };
    }
  }
}
