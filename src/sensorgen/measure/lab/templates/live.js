"use strict";
// Time, force, set force, place; then R of each tone, X of each tone, and the same as predicted.
const MINUTE_S = 60, POLL_MS = 200, LOST_MS = 3000;
const byId = id => document.getElementById(id);
const page = { rows: [], next: 0, tones: [], quantity: "z", heard: Date.now(), last: "", state: null };

const QUANTITIES = {
  z: (row, at, m) => row[at] === null || row[at + m] === null ? null : Math.hypot(row[at], row[at + m]),
  r: (row, at) => row[at],
  x: (row, at, m) => row[at + m],
};

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

function addTone(name, k) {
  const figure = document.createElement("figure");
  figure.innerHTML = '<figcaption><span class="name"></span><span class="value"></span><span class="residual"></span></figcaption><canvas role="img"></canvas>';
  figure.querySelector(".name").textContent = name;
  figure.querySelector("canvas").setAttribute("aria-label", `Impedance at ${name} over the last minute`);
  figure.id = `tone-${k}`;
  byId("tones").append(figure);
}

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

function residual(row, k, m) {
  if (!row || row.length < 4 + 4 * m) return "";
  const [r, x, pr, px] = [0, m, 2 * m, 3 * m].map(at => row[4 + at + k]);
  if ([r, x, pr, px].includes(null)) return "residual -";
  return `residual ${(100 * Math.hypot(r - pr, x - px) / Math.hypot(pr, px)).toFixed(2)} % of prediction`;
}

function show() {
  const rows = page.rows, m = page.tones.length, row = rows[rows.length - 1], state = page.state;
  if (state) {
    byId("message").textContent = state.message;
    byId("step").textContent = `${state.step} of ${state.steps}`;
    byId("elapsed").textContent = duration(state.elapsed_s);
    byId("left").textContent = duration(state.left_s);
    const bar = byId("bar");
    bar.setAttribute("aria-valuemax", state.steps);
    bar.setAttribute("aria-valuenow", state.step);
    bar.firstElementChild.style.width = `${100 * Math.min(1, state.step / Math.max(1, state.steps))}%`;
  }
  if (row) {
    byId("force").textContent = fixed(row[1], 2, "N");
    byId("set").textContent = fixed(row[2], 2, "N");
    byId("place").textContent = fixed(row[3], 1, "mm");
  }
  draw(byId("chart-force"), [
    { value: r => r[2], colour: "--expected", dashed: true }, { value: r => r[1], colour: "--measured" }], rows, { least: () => 0.1 });
  draw(byId("chart-place"), [{ value: r => r[3], colour: "--measured" }], rows, { least: () => 1 });
  const pick = QUANTITIES[page.quantity];
  page.tones.forEach((_, k) => {
    const figure = byId(`tone-${k}`);
    figure.querySelector(".value").textContent = row ? si(pick(row, 4 + k, m), "ohm") : "-";
    figure.querySelector(".residual").textContent = residual(row, k, m);
    draw(figure.querySelector("canvas"), [
      { value: r => r.length > 4 + 2 * m ? pick(r, 4 + 2 * m + k, m) : null, colour: "--expected", dashed: true },
      { value: r => pick(r, 4 + k, m), colour: "--measured" },
    ], rows, { unit: "ohm", least: (low, high) => 0.002 * Math.max(Math.abs(low), Math.abs(high)) || 1 });
  });
  buttons();
  document.documentElement.dataset.drawn = "yes";
}

function buttons() {
  const over = page.last === "abort", paused = page.last === "pause";
  byId("pause").querySelector("span").textContent = paused ? "Resume" : "Pause";
  byId("pause").disabled = over;
  byId("abort").querySelector("span").textContent = over ? "Aborting" : "Abort";
  const notice = byId("notice"), silent = Date.now() - page.heard;
  const text = silent > LOST_MS ? `No answer from the run for ${Math.round(silent / 1000)} s: it has ended or stopped.`
    : over ? "Abort requested: the run lifts the tip and ends." : paused ? "Pause requested." : "";
  if (notice.textContent !== text) notice.textContent = text;
  notice.hidden = !text;
}

async function send(command) {
  page.last = command;
  buttons();
  try {
    const answer = await fetch("command", { method: "POST", body: command });
    if (!answer.ok) throw new Error(answer.status);
  } catch {
    byId("notice").hidden = false;
    byId("notice").textContent = `The command "${command}" did not reach the run. Use Ctrl-C in its terminal.`;
  }
}

async function poll() {
  try {
    const answer = await fetch(`data?after=${page.next}`);
    if (!answer.ok) throw new Error(answer.status);
    const data = await answer.json();
    page.heard = Date.now();
    page.next = data.next;
    page.state = data.state;
    page.last = data.last;
    page.rows = page.rows.concat(data.rows);
    const end = page.rows.length ? page.rows[page.rows.length - 1][0] : 0;
    page.rows = page.rows.filter(row => row[0] > end - MINUTE_S && row[0] <= end);
    if (!document.hidden) show();
  } catch {
    buttons();
  }
  setTimeout(poll, POLL_MS);
}

const toggle = () => { if (page.last !== "abort") send(page.last === "pause" ? "resume" : "pause"); };
byId("pause").addEventListener("click", toggle);
byId("abort").addEventListener("click", () => send("abort"));
document.addEventListener("keydown", event => {
  if (event.repeat || event.ctrlKey || event.altKey || event.metaKey) return;
  if (event.key === "Escape") send("abort");
  if (event.key === " ") { event.preventDefault(); toggle(); }
});
document.addEventListener("keyup", event => { if (event.key === " ") event.preventDefault(); });
for (const button of document.querySelectorAll("[data-quantity]")) {
  button.addEventListener("click", () => {
    page.quantity = button.dataset.quantity;
    for (const each of document.querySelectorAll("[data-quantity]")) each.setAttribute("aria-pressed", each === button);
    show();
  });
}
document.addEventListener("visibilitychange", () => { if (!document.hidden) show(); });
addEventListener("resize", show);
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", show);
fetch("about").then(answer => answer.json()).then(about => {
  page.tones = about.tones;
  byId("title").textContent = document.title = about.title;
  about.tones.forEach(addTone);
  poll();
});
