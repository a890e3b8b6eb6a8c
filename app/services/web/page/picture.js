// SPDX-License-Identifier: MIT
// A picture as the server sends it (app/doc/reference/web.md), and the arithmetic of drawing it. No DOM here.

export const MISSING = 1;
export const BAD = 2;

// The head, and for each channel min and max of each column.
export function decode(buffer) {
  const view = new DataView(buffer);
  const length = view.getUint32(0, true);
  const head = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 4, length)));
  const columns = [];
  let at = 4 + length;
  for (let i = 0; i < head.channels.length; i++) {
    const min = floats(view, at, head.pixels);
    const max = floats(view, at + 4 * head.pixels, head.pixels);
    columns.push({ min, max });
    at += 8 * head.pixels;
  }
  return { ...head, columns, marks: new Uint8Array(buffer, at, head.pixels) };
}

function floats(view, at, count) {
  const values = new Float32Array(count);
  for (let i = 0; i < count; i++) {
    values[i] = view.getFloat32(at + 4 * i, true);
  }
  return values;
}

export const PLAIN = { scale: 1, offset: 0 };

// The bounds that one axis needs for these channels of the picture as they are drawn, with room above and below.
export function bounds(picture, indices, scales = []) {
  let low = Infinity;
  let high = -Infinity;
  for (const i of indices) {
    for (let k = 0; k < picture.pixels; k++) {
      if (!Number.isNaN(picture.columns[i].min[k])) {
        const { scale, offset } = scales[i] ?? PLAIN;
        const ends = [picture.columns[i].min[k] * scale + offset, picture.columns[i].max[k] * scale + offset];
        low = Math.min(low, ...ends);
        high = Math.max(high, ...ends);
      }
    }
  }
  if (low > high) {
    return { low: 0, high: 1 };
  }
  const room = high > low ? (high - low) * 0.08 : Math.max(Math.abs(high), 1) * 0.08;
  return { low: low - room, high: high + room };
}

// About `count` round numbers in [low, high].
export function ticks(low, high, count) {
  const raw = (high - low) / Math.max(count, 1);
  const power = 10 ** Math.floor(Math.log10(raw));
  const step = [1, 2, 5, 10].map((f) => f * power).find((s) => s >= raw * 0.999);
  const found = [];
  for (let n = Math.ceil(low / step); n * step <= high + step * 1e-9; n++) {
    found.push(n * step);
  }
  return found;
}

// Runs of columns that have a good sample: between two runs nothing is drawn.
export function runs(column) {
  const found = [];
  let start = -1;
  for (let k = 0; k <= column.min.length; k++) {
    const is_there = k < column.min.length && !Number.isNaN(column.min[k]);
    if (is_there && start < 0) {
      start = k;
    } else if (!is_there && start >= 0) {
      found.push([start, k]);
      start = -1;
    }
  }
  return found;
}

// The value at a column: the middle of its least and largest one; null: there is none.
export function value_at(picture, channel, pixel) {
  const column = picture.columns[channel];
  const value = (column.min[pixel] + column.max[pixel]) / 2;
  return Number.isNaN(value) || pixel < 0 || pixel >= picture.pixels ? null : value;
}

export function format(value, digits = 6) {
  if (value === null || value === undefined || Number.isNaN(value)) {
    return "–";
  }
  const size = Math.abs(value);
  if (Number.isInteger(value) && size < 1e15) {
    return String(value);
  }
  return size >= 1e6 || size < 1e-4 ? value.toExponential(digits - 1) : String(Number(value.toPrecision(digits)));
}

export function format_seconds(seconds) {
  const size = Math.abs(seconds);
  if (size >= 1 || size === 0) {
    return `${format(seconds)} s`;
  }
  return size >= 1e-3 ? `${format(seconds * 1e3)} ms` : `${format(seconds * 1e6)} µs`;
}
