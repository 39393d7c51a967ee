"use strict";
// Of every live page: numbers in words, and lines over the last minute.
const MINUTE_S = 60, POLL_MS = 200, LOST_MS = 3000;
const byId = id => document.getElementById(id);

function si(value, unit) {
  if (value === null || value === undefined) return "-";
  const size = Math.abs(value);
  const [factor, prefix] = [[1e9, "G"], [1e6, "M"], [1e3, "k"], [1, ""], [1e-3, "m"]].find(([f]) => size >= f) || [1, ""];
  return `${(value / factor).toPrecision(4)} ${prefix}${unit}`;
}

function duration(seconds) {
  if (seconds === null) return "-";
  const all = Math.round(seconds), two = n => String(n).padStart(2, "0");
  const clock = `${two(Math.floor(all / 60) % 60)}:${two(all % 60)}`;
  return all < 3600 ? clock : `${Math.floor(all / 3600)}:${clock}`;
}

const fixed = (value, digits, unit) => value === null || value === undefined ? "-" : `${value.toFixed(digits)} ${unit}`;

function ticks(low, high) {
  const raw = (high - low) / 4, power = 10 ** Math.floor(Math.log10(raw));
  const step = [1, 2, 5, 10].map(n => n * power).find(n => n >= raw);
  const made = [];
  for (let k = Math.ceil(low / step - 1e-9); k * step <= high + 1e-9 * step; k++) made.push(k * step);
  return [made, step];
}

function tickText(value, step, unit) {
  if (unit) {
    const [factor, prefix] = [[1e9, "G"], [1e6, "M"], [1e3, "k"], [1, ""]].find(([f]) => Math.abs(value) >= f) || [1, ""];
    return `${(value / factor).toFixed(Math.max(0, -Math.floor(Math.log10(step / factor) + 1e-9)))}${prefix}`;
  }
  return value.toFixed(Math.max(0, -Math.floor(Math.log10(step) + 1e-9)));
}

function limits(lines, rows, least) {
  let low = Infinity, high = -Infinity;
  for (const line of lines) for (const row of rows) {
    const value = line.value(row);
    if (value !== null && value !== undefined) { low = Math.min(low, value); high = Math.max(high, value); }
  }
  if (low > high) return null;
  const room = Math.max((high - low) * 0.08, least(low, high));
  return [low - room, high + room];
}

function draw(canvas, lines, rows, { unit = "", least = () => 0.05 } = {}) {
  const style = getComputedStyle(document.documentElement), colour = name => style.getPropertyValue(name).trim();
  const ratio = window.devicePixelRatio || 1, width = canvas.clientWidth, height = canvas.clientHeight;
  if (canvas.width !== Math.round(width * ratio) || canvas.height !== Math.round(height * ratio)) {
    canvas.width = Math.round(width * ratio);
    canvas.height = Math.round(height * ratio);
  }
  const pen = canvas.getContext("2d");
  pen.setTransform(ratio, 0, 0, ratio, 0, 0);
  pen.clearRect(0, 0, width, height);
  pen.font = "12px system-ui, sans-serif";
  const end = rows.length ? rows[rows.length - 1][0] : 0, range = limits(lines, rows, least);
  const left = 52, right = width - 4, top = 6, bottom = height - 18;
  const x = time => right - (end - time) / MINUTE_S * (right - left);
  pen.fillStyle = colour("--faint");
  pen.strokeStyle = colour("--line");
  pen.lineWidth = 1;
  pen.textAlign = "center";
  for (const back of [60, 45, 30, 15]) pen.fillText(`-${back} s`, Math.max(x(end - back), left + 12), height - 4);
  pen.fillText("now", right - 12, height - 4);
  if (!range) { pen.fillText("no value", (left + right) / 2, (top + bottom) / 2); return; }
  const y = value => bottom - (value - range[0]) / (range[1] - range[0]) * (bottom - top);
  pen.textAlign = "right";
  const [marks, step] = ticks(...range);
  for (const mark of marks) {
    pen.beginPath(); pen.moveTo(left, y(mark)); pen.lineTo(right, y(mark)); pen.stroke();
    pen.fillText(tickText(mark, step, unit), left - 5, y(mark) + 4);
  }
  for (const line of lines) {
    pen.strokeStyle = colour(line.colour);
    pen.lineWidth = 1.6;
    pen.setLineDash(line.dashed ? [5, 4] : []);
    pen.beginPath();
    let down = false;
    for (const row of rows) {
      const value = line.value(row);
      if (value === null || value === undefined) { down = false; continue; }
      if (down) pen.lineTo(x(row[0]), y(value)); else pen.moveTo(x(row[0]), y(value));
      down = true;
    }
    pen.stroke();
    pen.setLineDash([]);
  }
}
