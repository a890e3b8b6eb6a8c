// SPDX-License-Identifier: MIT
// Amplitude spectrum of evenly spaced samples. No DOM here.
import { runs } from "./picture.js";

const LEAST = 64;

// Coefficients of cosine windows: sum of (-1)^k a[k] cos(2 pi k n / N).
export const WINDOWS = {
  hann: [0.5, 0.5],
  flattop: [0.21557895, 0.41663158, 0.277263158, 0.083578947, 0.006947368],
  rectangular: [1],
};

export function weights(window, count) {
  return Float64Array.from({ length: count }, (_, n) =>
    WINDOWS[window].reduce((sum, a, k) => sum + (k % 2 === 0 ? a : -a) * Math.cos((2 * Math.PI * k * n) / count), 0));
}

// In place; the length is a power of two.
export function transform(re, im) {
  const count = re.length;
  for (let i = 1, j = 0; i < count; i++) {
    let bit = count >> 1;
    for (; j & bit; bit >>= 1) {
      j ^= bit;
    }
    j ^= bit;
    if (i < j) {
      [re[i], re[j]] = [re[j], re[i]];
      [im[i], im[j]] = [im[j], im[i]];
    }
  }
  for (let size = 2; size <= count; size *= 2) {
    butterflies(re, im, size);
  }
}

function butterflies(re, im, size) {
  const half = size / 2;
  for (let k = 0; k < half; k++) {
    const c = Math.cos((-2 * Math.PI * k) / size);
    const s = Math.sin((-2 * Math.PI * k) / size);
    for (let a = k; a < re.length; a += size) {
      const b = a + half;
      const x = re[b] * c - im[b] * s;
      const y = re[b] * s + im[b] * c;
      re[b] = re[a] - x;
      im[b] = im[a] - y;
      re[a] += x;
      im[a] += y;
    }
  }
}

// The longest part without a gap, cut to a power of two at its end; null: it is too short.
export function usable(column) {
  const [start, end] = runs(column).reduce((best, run) => (run[1] - run[0] >= best[1] - best[0] ? run : best), [0, 0]);
  const count = 2 ** Math.floor(Math.log2(Math.max(end - start, 1)));
  return count < LEAST ? null : Float64Array.from(column.min.subarray(end - count, end));
}

// Peak amplitude of each line in the signal's unit; line k is at k / (count * period). Line 0 is the mean.
export function amplitudes(samples, window) {
  const count = samples.length;
  const mean = samples.reduce((sum, value) => sum + value, 0) / count;
  const weight = weights(window, count);
  const total = weight.reduce((sum, value) => sum + value, 0);
  const re = samples.map((value, n) => (value - mean) * weight[n]);
  const im = new Float64Array(count);
  transform(re, im);
  const found = Float64Array.from({ length: count / 2 }, (_, k) => (2 * Math.hypot(re[k], im[k])) / total);
  found[0] = Math.abs(mean);
  return found;
}

// The line with the largest amplitude besides the mean.
export function peak_of(lines) {
  return lines.reduce((best, value, k) => (k > 0 && value > lines[best] ? k : best), 1);
}
