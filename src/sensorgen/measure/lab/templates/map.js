"use strict";
// Rows: time, force, centre x and y, area, peak. The state has the pressures of the last frame, row by row; null where
// nothing is determined, which is hatched, never drawn as no pressure.
const TRACE_S = 5, COLOURS = [[68, 1, 84], [59, 82, 139], [33, 145, 140], [94, 201, 98], [253, 231, 37]];
const page = { rows: [], next: 0, heard: Date.now(), state: null, about: null, most: 50 };

function colour(share) {
  const at = Math.min(0.9999, Math.max(0, share)) * (COLOURS.length - 1), k = Math.floor(at);
  return `rgb(${COLOURS[k].map((v, c) => Math.round(v + (at - k) * (COLOURS[k + 1][c] - v))).join(" ")})`;
}

function sized(canvas) {
  const ratio = window.devicePixelRatio || 1;
  canvas.width = Math.round(canvas.clientWidth * ratio);
  canvas.height = Math.round(canvas.clientHeight * ratio);
  const pen = canvas.getContext("2d");
  pen.setTransform(ratio, 0, 0, ratio, 0, 0);
  return pen;
}

function hatched(pen, x, y, width, height, ink) {
  pen.save();
  pen.beginPath(); pen.rect(x, y, width, height); pen.clip();
  pen.strokeStyle = ink;
  pen.lineWidth = 1;
  for (let at = -height; at < width; at += 5) { pen.beginPath(); pen.moveTo(x + at, y + height); pen.lineTo(x + at + height, y); pen.stroke(); }
  pen.restore();
}

function drawMap() {
  const { outline, x, y, pitch, here } = page.about, canvas = byId("map");
  const xs = outline.map(p => p[0]), ys = outline.map(p => p[1]), low = [Math.min(...xs), Math.min(...ys)];
  const size = [Math.max(...xs) - low[0], Math.max(...ys) - low[1]], margin = 6;
  canvas.style.height = `${Math.min(0.6 * innerHeight, canvas.clientWidth * size[1] / size[0] + margin)}px`;
  const pen = sized(canvas);
  const scale = Math.min((canvas.clientWidth - 2 * margin) / size[0], (canvas.clientHeight - 2 * margin) / size[1]);
  const left = (canvas.clientWidth - size[0] * scale) / 2;
  const px = v => left + (v - low[0]) * scale, py = v => canvas.clientHeight - margin - (v - low[1]) * scale;
  const style = getComputedStyle(document.documentElement), ink = style.getPropertyValue("--faint").trim();
  const kpa = page.state && page.state.kpa;
  if (kpa) page.most = Math.max(50, 0.98 * page.most, ...kpa.filter(v => v !== null));
  here.forEach((row, i) => row.forEach((inside, j) => {
    if (!inside) return;
    const at = [px(x[j] - pitch[0] / 2), py(y[i] + pitch[1] / 2), pitch[0] * scale - 1, pitch[1] * scale - 1];
    const value = kpa ? kpa[i * x.length + j] : null;
    if (value === null) return hatched(pen, ...at, ink);
    pen.fillStyle = colour(value / page.most);
    pen.fillRect(...at);
  }));
  pen.fillStyle = ink;
  pen.font = `${Math.max(9, Math.min(12, 0.5 * pitch[1] * scale))}px system-ui, sans-serif`;
  pen.textAlign = "center";
  pen.textBaseline = "middle";
  const every = side => Math.max(1, Math.ceil(24 / (side * scale)));  // of a name, in pixels
  y.forEach((at, i) => { if (i % every(pitch[1]) === 0) pen.fillText(`r${i + 1}`, px(x[0] - pitch[0]), py(at)); });
  x.forEach((at, j) => { if (j % every(pitch[0]) === 0) pen.fillText(`c${j + 1}`, px(at), py(y[0] - pitch[1])); });
  const press = page.state && page.state.press;
  if (press) {
    const [i, j] = press.at;
    pen.strokeStyle = style.getPropertyValue(press.swapped ? "--stop" : "--measured").trim();
    pen.lineWidth = 3;
    pen.strokeRect(px(x[j] - pitch[0] / 2), py(y[i] + pitch[1] / 2), pitch[0] * scale - 1, pitch[1] * scale - 1);
  }
  pen.strokeStyle = ink;
  pen.lineWidth = 1.5;
  pen.beginPath();
  outline.forEach((p, k) => k ? pen.lineTo(px(p[0]), py(p[1])) : pen.moveTo(px(p[0]), py(p[1])));
  pen.stroke();
  const end = page.rows.length ? page.rows[page.rows.length - 1][0] : 0;
  const trace = page.rows.filter(r => r[0] > end - TRACE_S);
  for (const [stroke, width] of [["#ffffff", 4], ["#b3121d", 2]]) {
    pen.strokeStyle = stroke;
    pen.lineWidth = width;
    pen.beginPath();
    let down = false;
    for (const row of trace) {
      if (row[2] === null || row[3] === null) { down = false; continue; }
      if (down) pen.lineTo(px(row[2]), py(row[3])); else pen.moveTo(px(row[2]), py(row[3]));
      down = true;
    }
    pen.stroke();
  }
  byId("scale").textContent = `0 (violet) to ${page.most.toPrecision(3)} (yellow); hatched: not determined; red: centre of pressure, last ${TRACE_S} s`;
}

function show() {
  const state = page.state, row = page.rows[page.rows.length - 1];
  if (state) {
    byId("message").textContent = state.by;
    byId("press").hidden = !state.press;
    byId("press").textContent = state.press ? state.press.words : "";
    byId("press").className = state.press && state.press.swapped ? "swapped" : "";
    byId("frames").textContent = state.frames;
    byId("lost").textContent = `${state.lost}, ${state.damaged}` + (state.saturated ? `; ${state.saturated} saturated` : "");
    byId("dropped").textContent = state.dropped + state.skipped;
    byId("recorded").textContent = state.recording === null ? "no file" : state.recorded;
    byId("record").disabled = state.recording === null;
    byId("record").querySelector("span").textContent = state.recording ? "Stop recording" : "Record";
    byId("pause").querySelector("span").textContent = state.paused ? "Resume" : "Pause";
    const body = byId("regions"), shown = state.regions || [];
    byId("of-regions").hidden = !shown.length;
    body.replaceChildren(...shown.map(cells => {
      const line = document.createElement("tr");
      line.append(...cells.map(value => Object.assign(document.createElement("td"), { textContent: value === null ? "-" : value })));
      return line;
    }));
  }
  if (row) {
    const sigma = state && state.sigma ? ` \u00b1 ${state.sigma.toPrecision(2)}` : "";
    byId("force").textContent = row[1] === null ? "-" : `${row[1].toFixed(1)}${sigma} N`;
    byId("centre").textContent = row[2] === null ? "-" : `${row[2].toFixed(1)}, ${row[3].toFixed(1)} mm`;
    byId("contact").textContent = fixed(row[4], 0, "mm2");
    byId("peak").textContent = fixed(row[5], 0, "kPa");
  }
  drawMap();
  draw(byId("chart-force"), [{ value: r => r[1], colour: "--measured" }], page.rows, { least: () => 1 });
  notice();
  document.documentElement.dataset.drawn = "yes";
}

function notice() {
  const silent = Date.now() - page.heard, box = byId("notice");
  box.textContent = silent > LOST_MS ? `No answer for ${Math.round(silent / 1000)} s: the recording has ended or stopped.` : "";
  box.hidden = !box.textContent;
}

async function send(command) {
  try {
    const answer = await fetch("command", { method: "POST", body: command });
    if (!answer.ok) throw new Error(answer.status);
  } catch {
    byId("notice").hidden = false;
    byId("notice").textContent = `The command "${command}" did not arrive. Use Ctrl-C in its terminal.`;
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
    page.rows = page.rows.concat(data.rows);
    const end = page.rows.length ? page.rows[page.rows.length - 1][0] : 0;
    page.rows = page.rows.filter(row => row[0] > end - MINUTE_S && row[0] <= end);
    if (!document.hidden) show();
  } catch {
    notice();
  }
  setTimeout(poll, POLL_MS);
}

const toggle = () => send(page.state && page.state.paused ? "resume" : "pause");
byId("pause").addEventListener("click", toggle);
byId("rest").addEventListener("click", () => send("rest"));
byId("record").addEventListener("click", () => send("record"));
byId("abort").addEventListener("click", () => send("stop"));
document.addEventListener("keydown", event => {
  if (event.repeat || event.ctrlKey || event.altKey || event.metaKey) return;
  if (event.key === "Escape") send("stop");
  if (event.key === "u") send("rest");
  if (event.key === "r" && !byId("record").disabled) send("record");
  if (event.key === " ") { event.preventDefault(); toggle(); }
});
document.addEventListener("keyup", event => { if (event.key === " ") event.preventDefault(); });
document.addEventListener("visibilitychange", () => { if (!document.hidden) show(); });
addEventListener("resize", () => page.about && show());
fetch("about").then(answer => answer.json()).then(about => {
  page.about = about;
  byId("title").textContent = document.title = about.title;
  poll();
});
