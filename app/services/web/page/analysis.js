// SPDX-License-Identifier: MIT
// Below the scope: the spectrum of what is shown, or one channel over another. Of samples, not of columns of pixels.
import { plot_area, line } from "./chart.js";
import { format, ticks } from "./picture.js";
import { set_text } from "./table.js";
import { amplitudes, peak_of, usable } from "./spectrum.js";

const by_id = (id) => document.getElementById(id);
const WINDOW_NAMES = { hann: "Hann", flattop: "flat top", rectangular: "rectangular" };
const SAMPLES = 4096; // the server's limit for one column for each sample

export class Analysis {
  // on_change() is called when a control is changed.
  constructor(on_change) {
    this.canvas = by_id("analysis-canvas");
    for (const id of ["analysis-kind", "analysis-window"]) {
      by_id(id).addEventListener("input", () => {
        this.show();
        on_change();
      });
    }
    new ResizeObserver(() => this.draw()).observe(this.canvas);
    this.show();
  }

  // For the address.
  fields() {
    return { a: this.kind(), aw: by_id("analysis-window").value };
  }

  read(fields) {
    by_id("analysis-kind").value = ["fft", "xy"].find((kind) => kind === fields.get("a")) ?? "none";
    by_id("analysis-window").value = Object.keys(WINDOW_NAMES).find((name) => name === fields.get("aw")) ?? "hann";
    this.show();
  }

  kind() {
    return by_id("analysis-kind").value;
  }

  is_on() {
    return this.kind() !== "none";
  }

  show() {
    by_id("analysis").hidden = !this.is_on();
    by_id("analysis-window").closest("label").hidden = this.kind() !== "fft";
    this.draw();
  }

  // So many of the cycles that are shown, up to the same end.
  cycles(shown) {
    return Math.min(shown, SAMPLES);
  }

  // channels: of the table, for each of the picture.
  take(picture, channels, period_s) {
    this.picture = picture;
    this.channels = channels;
    this.period_s = period_s;
    this.draw();
  }

  draw() {
    if (this.is_on() && this.picture && this.canvas.clientWidth > 0) {
      const plot = this.kind() === "fft" ? this.spectrum() : this.pairs();
      set_text(by_id("analysis-note"), plot.note);
      paint(this.canvas, plot);
    }
  }

  spectrum() {
    const window = by_id("analysis-window").value;
    const notes = [];
    const series = [];
    let step = 1;
    this.picture.columns.forEach((column, i) => {
      const samples = usable(column);
      const { name, unit } = this.channels[i];
      if (samples === null) {
        notes.push(`${name}: too few good samples in a row`);
        return;
      }
      step = 1 / (samples.length * this.period_s);
      const lines = amplitudes(samples, window);
      const peak = peak_of(lines);
      notes.push(`${name}: ${format(peak * step, 5)} Hz, ${format(lines[peak], 4)} ${unit}`);
      series.push({ colour: `--c${i}`, x: Float64Array.from(lines, (_, k) => k * step).subarray(1), y: lines.subarray(1) });
    });
    const high = Math.max(...series.map(({ y }) => y.reduce((a, b) => Math.max(a, b), 0)), 0) || 1;
    const units = new Set(this.channels.map(({ unit }) => unit));
    return {
      series, x: { low: 0, high: 0.5 / this.period_s, unit: "Hz" },
      y: { low: 0, high: high * 1.08, unit: units.size === 1 ? [...units][0] : "" },
      note: series.length === 0 ? notes.join("; ")
        : `Largest line (${WINDOW_NAMES[window]}, ${format(step, 4)} Hz a line): ${notes.join("; ")}`,
    };
  }

  // The first channel is x, the others are y.
  pairs() {
    const [x, ...others] = this.picture.columns;
    const range = (columns) => {
      const values = columns.flatMap(({ min }) => [...min]).filter((value) => !Number.isNaN(value));
      const low = values.reduce((a, b) => Math.min(a, b), Infinity);
      const high = values.reduce((a, b) => Math.max(a, b), -Infinity);
      const room = high > low ? (high - low) * 0.05 : 1;
      return low > high ? { low: 0, high: 1 } : { low: low - room, high: high + room };
    };
    const names = this.channels.slice(1).map(({ name }) => name).join(", ");
    return {
      series: others.map(({ min }, i) => ({ colour: `--c${i + 1}`, x: x?.min ?? [], y: min })),
      x: { ...range(x ? [x] : []), unit: this.channels[0]?.unit ?? "" },
      y: { ...range(others), unit: this.channels[1]?.unit ?? "" },
      note: others.length > 0 ? `${names} over ${this.channels[0].name}` : "Two channels are required: the first is x.",
    };
  }
}

function paint(canvas, { series, x, y }) {
  const ratio = devicePixelRatio || 1;
  const { clientWidth: width, clientHeight: height } = canvas;
  const style = getComputedStyle(canvas);
  const colour = (name) => style.getPropertyValue(name).trim();
  const area = plot_area(width, height);
  const context = canvas.getContext("2d");
  const x_of = (value) => area.x + ((value - x.low) / (x.high - x.low)) * area.width;
  const y_of = (value) => area.y + area.height - ((value - y.low) / (y.high - y.low)) * area.height;

  canvas.width = Math.round(width * ratio);
  canvas.height = Math.round(height * ratio);
  context.setTransform(ratio, 0, 0, ratio, 0, 0);
  context.font = "12px system-ui, sans-serif";
  context.fillStyle = colour("--soft");
  context.textAlign = "center";
  for (const tick of ticks(x.low, x.high, area.width / 90)) {
    line(context, colour("--line"), [], [x_of(tick), area.y], [x_of(tick), area.y + area.height]);
    context.fillText(`${format(Number(tick.toPrecision(6)), 4)} ${x.unit}`, x_of(tick), area.y + area.height + 16);
  }
  context.textAlign = "right";
  for (const tick of ticks(y.low, y.high, area.height / 50)) {
    line(context, colour("--line"), [], [area.x, y_of(tick)], [area.x + area.width, y_of(tick)]);
    context.fillText(`${format(Number(tick.toPrecision(6)), 4)} ${y.unit}`, area.x - 6, y_of(tick) + 4);
  }
  for (const one of series) {
    context.strokeStyle = colour(one.colour);
    context.lineWidth = 1.3;
    context.beginPath();
    let is_down = false;
    one.y.forEach((value, k) => {
      const is_there = !Number.isNaN(value) && !Number.isNaN(one.x[k]);
      if (is_there) {
        is_down ? context.lineTo(x_of(one.x[k]), y_of(value)) : context.moveTo(x_of(one.x[k]), y_of(value));
      }
      is_down = is_there;
    });
    context.stroke();
  }
}
