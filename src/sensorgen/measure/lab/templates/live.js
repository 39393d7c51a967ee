"use strict";
// Time, force, set force, place; then R of each tone, X of each tone, and the same as predicted.
const page = { rows: [], next: 0, tones: [], quantity: "z", heard: Date.now(), last: "", state: null };

const QUANTITIES = {
  z: (row, at, m) => row[at] === null || row[at + m] === null ? null : Math.hypot(row[at], row[at + m]),
  r: (row, at) => row[at],
  x: (row, at, m) => row[at + m],
};

function addTone(name, k) {
  const figure = document.createElement("figure");
  figure.innerHTML = '<figcaption><span class="name"></span><span class="value"></span><span class="residual"></span></figcaption><canvas role="img"></canvas>';
  figure.querySelector(".name").textContent = name;
  figure.querySelector("canvas").setAttribute("aria-label", `Impedance at ${name} over the last minute`);
  figure.id = `tone-${k}`;
  byId("tones").append(figure);
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
