"use strict";
// Numbers: packed arrays, vectors, quaternions [w, x, y, z], and how they are written.

/** The 64-bit floats of a text in base64. */
function unpack(text) {
  return new Float64Array(Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0)).buffer);
}

const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const norm = (a) => Math.hypot(a[0], a[1], a[2]);
const minus = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
const plus = (a, b, factor = 1) => [a[0] + factor * b[0], a[1] + factor * b[1], a[2] + factor * b[2]];
const times = (a, factor) => [a[0] * factor, a[1] * factor, a[2] * factor];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const unit = (a) => times(a, 1 / (norm(a) || 1));
/** The largest of many numbers; there is at least one. */
const most = (values) => values.reduce((largest, value) => Math.max(largest, value), -Infinity);
/** The `k`-th vector of an array of them. */
const nth = (array, k) => [array[3 * k], array[3 * k + 1], array[3 * k + 2]];

const conjugate = (q) => [q[0], -q[1], -q[2], -q[3]];
function compose(a, b) {
  return [
    a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3],
    a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
    a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1],
    a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0],
  ];
}
function rotate(q, v) {
  const u = [q[1], q[2], q[3]];
  const t = times(cross(u, v), 2);
  return plus(plus(v, t, q[0]), cross(u, t));
}
/** The rotation from axes, given in others, to those others. */
function fromAxes(x, y, z) {
  const squares = [1 + x[0] + y[1] + z[2], 1 + x[0] - y[1] - z[2], 1 - x[0] + y[1] - z[2], 1 - x[0] - y[1] + z[2]];
  const [a, b, c] = [y[2] - z[1], z[0] - x[2], x[1] - y[0]];
  const [d, e, f] = [x[1] + y[0], z[0] + x[2], y[2] + z[1]];
  const largest = squares.indexOf(most(squares));
  const all = [[squares[0], a, b, c], [a, squares[1], d, e], [b, d, squares[2], f], [c, e, f, squares[3]]][largest];
  const half = 0.5 / Math.sqrt(squares[largest]);
  return all.map((component) => component * half);
}
/** Yaw, pitch and roll (°): about z, then the turned y, then the turned x. */
function euler([w, x, y, z]) {
  const degrees = 180 / Math.PI;
  return [
    degrees * Math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z)),
    degrees * Math.asin(Math.min(1, Math.max(-1, 2 * (w * y - z * x)))),
    degrees * Math.atan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y)),
  ];
}

/** A number to some digits, without trailing zeros. */
function short(value, digits = 4) {
  if (!Number.isFinite(value)) return "–";
  const size = Math.abs(value);
  if (size !== 0 && (size < 1e-3 || size >= 1e6)) return value.toExponential(digits - 1).replace(/\.?0+e/, "e").replace("e+", "e");
  return String(Number(value.toPrecision(Math.max(digits, size < 1 ? 1 : Math.floor(Math.log10(size)) + 1))));
}

/** A factor, to two digits. */
function factorText(factor) {
  return factor < 10 ? factor.toFixed(1) : String(Number(factor.toPrecision(2)));
}

/** The unit of time for a duration (s). */
function timeUnit(duration) {
  const units = [["d", 86400, 2], ["h", 3600, 3], ["min", 60, 10]];
  const [symbol, size] = units.find(([, size, least]) => duration >= least * size) ?? ["s", 1];
  return { symbol, size };
}

/** What numbers up to `largest` of a unit are divided by so that they are short, and the unit then. */
function readable(largest, symbol, least = 5) {
  if (!(largest > 0)) return { size: 1, symbol };
  if (symbol === "m") {
    const [unit, size] = [["km", 1e3], ["m", 1], ["mm", 1e-3], ["µm", 1e-6]].find(([, size]) => largest >= size * (size > 1 ? least : 0.01 * least)) ?? ["nm", 1e-9];
    return { size, symbol: unit };
  }
  if (largest >= 0.02 && largest < (symbol === "°" ? 1e7 : 1e4)) return { size: 1, symbol };
  const power = 3 * Math.floor(Math.log10(largest) / 3);
  const raised = String(power).replace(/./g, (c) => "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"["-0123456789".indexOf(c)]);
  return { size: 10 ** power, symbol: `10${raised} ${symbol}`.trim() };
}

/** A length (m) with its unit. */
function lengthText(length) {
  const { size, symbol } = readable(length * 1.0001, "m", 1);
  return `${short(length / size, 3)} ${symbol}`;
}
