// SPDX-License-Identifier: MIT
// Draws a picture: for each channel the band from min to max of each column, joined where columns follow each
// other; gaps stay gaps.
import { BAD, MISSING, PLAIN, bounds, format, format_seconds, runs, ticks } from "./picture.js";

const MARGIN = { left: 64, right: 64, top: 8, bottom: 24 };
const TICK_PIXELS = 90;

// The plot's place on a canvas of this size.
export function plot_area(width, height) {
  return {
    x: MARGIN.left,
    y: MARGIN.top,
    width: Math.max(width - MARGIN.left - MARGIN.right, 10),
    height: Math.max(height - MARGIN.top - MARGIN.bottom, 10),
  };
}

// Indices of the picture's channels by unit: each unit has an axis of its own.
export function axes(picture, units, scales) {
  const groups = new Map();
  units.forEach((unit, i) => groups.set(unit, [...(groups.get(unit) ?? []), i]));
  return [...groups].map(([unit, indices]) => ({ unit, indices, ...bounds(picture, indices, scales) }));
}

// On the canvas as sharp as the screen is.
export function draw(canvas, picture, options) {
  const ratio = devicePixelRatio || 1;
  const context = canvas.getContext("2d");
  canvas.width = Math.round(canvas.clientWidth * ratio);
  canvas.height = Math.round(canvas.clientHeight * ratio);
  context.setTransform(ratio, 0, 0, ratio, 0, 0);
  context.font = "12px system-ui, sans-serif";
  paint(context, plot_area(canvas.clientWidth, canvas.clientHeight), picture, options);
}

// colour(name) is that of the style. zero: the cycle that is 0 s. scales: { scale, offset } of each channel.
// cursors: [{ name, cycle }]. levels: { values, index of the channel }. events: [{ cycle, severity }].
export function paint(context, area, picture, { units, colours, colour, period_s, zero, scales, cursors, levels, events }) {
  const x_of = (cycle) => area.x + ((cycle - picture.first) / picture.cycles) * area.width;
  const found = axes(picture, units, scales);

  draw_marks(context, picture, area, colour);
  draw_time(context, picture, area, { colour, period_s, zero, x_of });
  found.slice(0, 2).forEach((axis, n) => draw_axis(context, area, axis, n, colour));
  for (const axis of found) {
    for (const i of axis.indices) {
      const { scale, offset } = scales[i] ?? PLAIN;
      const y_of = (value) =>
        area.y + area.height - ((value * scale + offset - axis.low) / (axis.high - axis.low)) * area.height;
      draw_channel(context, picture, area, picture.columns[i], colour(colours[i]), y_of);
      for (const value of levels.index === i ? levels.values : []) {
        const y = Math.min(Math.max(y_of(value), area.y), area.y + area.height);
        line(context, colour("--soft"), [4, 4], [area.x, y], [area.x + area.width, y]);
      }
    }
  }
  for (const { cycle, severity } of events) {
    context.fillStyle = colour({ error: "--bad", warning: "--warning" }[severity] ?? "--soft");
    line(context, context.fillStyle, [1, 4], [x_of(cycle), area.y], [x_of(cycle), area.y + area.height]);
    context.fillRect(x_of(cycle) - 3, area.y, 6, 6);
  }
  for (const { name, cycle } of cursors) {
    line(context, colour("--front"), [2, 3], [x_of(cycle), area.y], [x_of(cycle), area.y + area.height]);
    context.fillStyle = colour("--front");
    context.fillText(name, x_of(cycle) + 3, area.y + 12);
  }
}

export function line(context, colour, dash, from, to) {
  context.strokeStyle = colour;
  context.lineWidth = 1;
  context.setLineDash(dash);
  context.beginPath();
  context.moveTo(...from);
  context.lineTo(...to);
  context.stroke();
  context.setLineDash([]);
}

function draw_marks(context, picture, area, colour) {
  const step = area.width / picture.pixels;
  for (let k = 0; k < picture.pixels; k++) {
    if (picture.marks[k] & MISSING) {
      context.fillStyle = colour("--gap");
      context.fillRect(area.x + k * step, area.y, Math.max(step, 1), area.height);
    }
    if (picture.marks[k] & BAD) {
      context.fillStyle = colour("--bad");
      context.fillRect(area.x + k * step, area.y + area.height - 4, Math.max(step, 1), 4);
    }
  }
}

function draw_time(context, picture, area, { colour, period_s, zero, x_of }) {
  const low = (picture.first - zero) * period_s;
  const high = (picture.first + picture.cycles - zero) * period_s;
  context.textAlign = "center";
  for (const tick of ticks(low, high, area.width / TICK_PIXELS)) {
    const x = x_of(tick / period_s + zero);
    line(context, colour("--line"), [], [x, area.y], [x, area.y + area.height]);
    context.fillStyle = colour("--soft");
    context.fillText(format_seconds(Number(tick.toPrecision(9))), x, area.y + area.height + 16);
  }
  context.textAlign = "left";
}

// The first axis is on the left, the second on the right.
function draw_axis(context, area, axis, n, colour) {
  context.textAlign = n === 0 ? "right" : "left";
  const x = n === 0 ? area.x - 6 : area.x + area.width + 6;
  for (const tick of ticks(axis.low, axis.high, area.height / 50)) {
    const y = area.y + area.height - ((tick - axis.low) / (axis.high - axis.low)) * area.height;
    if (n === 0) {
      line(context, colour("--line"), [], [area.x, y], [area.x + area.width, y]);
    }
    context.fillStyle = colour("--soft");
    context.fillText(`${format(Number(tick.toPrecision(6)), 4)} ${axis.unit}`, x, y + 4);
  }
  context.textAlign = "left";
}

function draw_channel(context, picture, area, column, colour, y_of) {
  const step = area.width / picture.pixels;
  const middle = (k) => area.x + (k + 0.5) * step;
  context.strokeStyle = colour;
  context.fillStyle = colour;
  context.lineWidth = 1.3;
  for (const [start, end] of runs(column)) {
    context.beginPath();
    for (let k = start; k < end; k++) {
      context.lineTo(middle(k), y_of(column.min[k]));
      if (column.max[k] !== column.min[k]) {
        context.lineTo(middle(k), y_of(column.max[k]));
      }
    }
    context.stroke();
    if (end - start === 1) {
      context.fillRect(middle(start) - 1, y_of(column.max[start]) - 1, 2, 2); // one sample alone
    }
  }
}
