const $ = name => document.getElementById(name), root = document.documentElement;
const each = (words, what) => document.querySelectorAll(words).forEach(what);

async function content() {
  const block = await unpacked("data").arrayBuffer(), length = new DataView(block).getUint32(0, true);
  const head = JSON.parse(new TextDecoder().decode(new Uint8Array(block, 4, length)));
  let at = 4 + length;
  function summed(count, step) { // differences to values
    const raw = new Int32Array(block, at, count);
    for (let k = step; k < count; k++) raw[k] += raw[k - step];
    at += 4 * count;
    return raw;
  }
  head.shells = {};
  for (const [kind, counts] of Object.entries(head.counts)) {
    head.shells[kind] = counts.map(([vertices, triangles, edges], body) => ({
      body, lift: 0, vertices: Float32Array.from(summed(3 * vertices, 3), v => v / 1000),
      triangles: Uint32Array.from(summed(3 * triangles, 1)), edges: Uint32Array.from(summed(2 * edges, 1)),
    }));
  }
  return head;
}

function rgb(name) {
  const words = getComputedStyle(root).getPropertyValue(name).trim();
  return [1, 3, 5].map(k => parseInt(words.slice(k, k + 2), 16) / 255);
}

function model(data) {
  const canvas = $("model"), size = data.size, view = { turn: 0, tilt: 0, scale: 1, centre: [0, 0, 0], pixels: 1 };
  let paint = solidPainter(canvas), asked = false, last = "detail";
  if (!paint) {
    paint = flatPainter(canvas);
    $("flat").hidden = false;
    $("flat").textContent = "WebGL is not available: a plain picture without cut faces. Sections and layers are complete.";
  }
  const kind = () => document.querySelector("[name=kind]:checked").value;
  const lift = () => $("lift").value / 100 * 3 * size[2];
  function plane() {
    const axis = $("axis").value, at = $("cut").value / 1000 * size[axis || 0];
    $("cut").disabled = axis === "";
    $("cut-at").textContent = axis === "" ? "" : `${"xyz"[axis]} = ${at.toFixed(2)} mm`;
    $("cut").setAttribute("aria-valuetext", $("cut-at").textContent);
    if (axis === "") return [0, 0, 0, 1];
    return [0, 1, 2].map(k => k === Number(axis) ? (k === 1 ? -1 : 1) : 0).concat(axis === "1" ? -at : at);
  }
  function draw() {
    asked = false;
    const shells = data.shells[kind()].filter(s => document.querySelector(`.body[value="${s.body}"]`).checked);
    data.shells[kind()].forEach((s, k) => { s.lift = k * lift(); });
    $("lift-at").textContent = `${lift().toFixed(1)} mm`;
    const colours = data.shells.drawn.map((_, k) => rgb(`--c${k}`));
    const deep = 2 * Math.hypot(size[0], size[1], size[2] * (1 + 3 * colours.length)) + 1;
    const ink = rgb("--ink")[0] > 0.5 ? rgb("--ground") : rgb("--ink");
    paint(shells, view, plane(), colours, rgb("--band"), ink, deep);
  }
  function ask() {
    if (!asked) requestAnimationFrame(draw);
    asked = true;
  }
  const VIEWS = { detail: [-0.5, 0.5], whole: [-0.5, 0.6], top: [0, Math.PI / 2], side: [0, 0] };
  function preset(name) {
    last = name;
    [view.turn, view.tilt] = VIEWS[name];
    const tall = size[2] + lift() * (data.shells.drawn.length - 1);
    const near = name === "detail" ? [0, $("axis").value === "1" ? $("cut").value / 1000 * size[1] : 0, 0] : [0, 0, 0];
    const far = name === "detail" ? [Math.min(size[0], 7 * size[2]), Math.min(size[1], near[1] + 4 * size[2]), tall]
      : [size[0], size[1], tall];
    view.centre = near.map((v, k) => (v + far[k]) / 2);
    view.scale = fitting(view, near, far, canvas.width, canvas.height);
    ask();
  }
  function zoom(factor) { view.scale = Math.min(Math.max(view.scale * factor, 0.2), 5000); ask(); last = ""; }
  function move(dx, dy) { // pixels of the canvas
    const [right, up] = axes(view);
    view.centre = view.centre.map((v, k) => v - (right[k] * dx - up[k] * dy) / view.scale);
    last = "";
    ask();
  }
  function turn(dx, dy) {
    view.turn += dx;
    view.tilt = Math.min(Math.max(view.tilt + dy, -Math.PI / 2), Math.PI / 2);
    last = "";
    ask();
  }
  const fingers = new Map();
  canvas.addEventListener("pointerdown", e => { canvas.setPointerCapture(e.pointerId); fingers.set(e.pointerId, e); });
  for (const end of ["pointerup", "pointercancel"]) canvas.addEventListener(end, e => fingers.delete(e.pointerId));
  canvas.addEventListener("pointermove", e => {
    const before = fingers.get(e.pointerId);
    if (!before) return;
    const dx = e.clientX - before.clientX, dy = e.clientY - before.clientY;
    if (fingers.size === 2) {
      const other = [...fingers].find(([id]) => id !== e.pointerId)[1];
      const apart = p => Math.hypot(p.clientX - other.clientX, p.clientY - other.clientY);
      move(dx / 2 * view.pixels, dy / 2 * view.pixels);
      zoom(apart(e) / Math.max(apart(before), 1));
    } else if (e.shiftKey || e.buttons & 6) move(dx * view.pixels, dy * view.pixels);
    else turn(dx * 0.01, dy * 0.01);
    fingers.set(e.pointerId, e);
  });
  canvas.addEventListener("wheel", e => { // the page scrolls unless the view has the focus
    if (document.activeElement !== canvas && !e.ctrlKey) return;
    e.preventDefault();
    zoom(Math.exp(-e.deltaY / 500));
  }, { passive: false });
  canvas.addEventListener("keydown", e => {
    const step = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] }[e.key];
    if (step) e.shiftKey ? move(step[0] * 30, step[1] * 30) : turn(step[0] * 0.1, step[1] * 0.1);
    else if (e.key === "+" || e.key === "=") zoom(1.2);
    else if (e.key === "-") zoom(1 / 1.2);
    else if (e.key === "Home") preset("detail");
    else return;
    e.preventDefault();
  });
  each("[data-view]", b => b.addEventListener("click", () => preset(b.dataset.view)));
  each("[data-zoom]", b => b.addEventListener("click", () => zoom(Number(b.dataset.zoom))));
  each("[name=kind], #axis, #cut, .body", input => input.addEventListener("input", ask));
  $("lift").addEventListener("input", () => (last ? preset(last) : ask()));
  new ResizeObserver(() => {
    const pixels = Math.min(devicePixelRatio || 1, 2), grown = canvas.clientWidth * pixels / canvas.width;
    [canvas.width, canvas.height, view.pixels] = [canvas.clientWidth * pixels, canvas.clientHeight * pixels, pixels];
    if (last) preset(last);
    else view.scale *= grown;
    draw();
  }).observe(canvas);
  return ask;
}

function plan(data) {
  const svg = $("plan"), slider = $("layer"), [length, width] = data.size;
  const node = (kind, has, title, inside) => {
    const made = document.createElementNS("http://www.w3.org/2000/svg", kind);
    for (const [name, value] of Object.entries(has)) made.setAttribute(name, value);
    if (title) made.append(node("title", {}, "", title));
    if (inside) made.textContent = inside;
    return made;
  };
  const bodies = [...document.querySelectorAll(".key span")].map(span => span.textContent);
  let box = [0, 0, 1, 1];
  function look(to) {
    box = to;
    svg.setAttribute("viewBox", box.join(" "));
  }
  function aspect() { return svg.clientWidth / Math.max(svg.clientHeight, 1); }
  function start(x) {
    const tall = 1.12 * width, wide = Math.min(tall * aspect(), 1.04 * length);
    look([Math.min(Math.max((x || 0) - wide / 2, -0.02 * wide), Math.max(1.02 * length - wide, -0.02 * wide)),
      -0.06 * width, wide, tall]);
  }
  function layer(k, group) {
    const made = node("g", group ? { class: group } : {});
    for (const [body, d] of Object.entries(data.layers[k].paths)) made.append(node("path", { class: `b${body}`, d }, bodies[body]));
    return made;
  }
  function show(k) {
    const at = data.layers[k];
    if (!at) return;
    slider.value = k;
    svg.replaceChildren(...(k ? [layer(k - 1, "below")] : []), layer(k, ""),
      ...at.marks.map(([x, y, words]) => node("circle", { cx: x, cy: width - y, r: width / 16 }, words)));
    $("layer-at").textContent = `${k + 1} of ${data.layers.length}: ${at.z[0]} to ${at.z[1]} mm`;
    slider.setAttribute("aria-valuetext", $("layer-at").textContent);
  }
  function zoom(f) {
    const [x, y, w, h] = box, c = [x + w / 2, y + h / 2];
    if (w * f < 0.05 * width || w * f > 4 * length) return;
    look([c[0] - w * f / 2, c[1] - h * f / 2, w * f, h * f]);
  }
  slider.addEventListener("input", () => show(Number(slider.value)));
  each("[data-plan]", b => b.addEventListener("click", () => {
    if (b.dataset.plan === "whole") look([-0.02 * length, -0.06 * width, 1.04 * length, 1.12 * width]);
    else zoom(b.dataset.plan === "in" ? 0.6 : 1 / 0.6);
  }));
  each("[data-layer]", b => b.addEventListener("click", () => {
    show(Number(b.dataset.layer));
    start(Number(b.dataset.x));
    svg.scrollIntoView({ block: "center" });
    slider.focus({ preventScroll: true });
  }));
  svg.addEventListener("keydown", e => {
    const step = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] }[e.key];
    if (step) look([box[0] + step[0] * box[2] / 10, box[1] + step[1] * box[3] / 10, box[2], box[3]]);
    else if (e.key === "+" || e.key === "=") zoom(0.8);
    else if (e.key === "-") zoom(1.25);
    else if (e.key === "Home") start(0);
    else return;
    e.preventDefault();
  });
  let held = null;
  svg.addEventListener("pointerdown", e => { held = [e.clientX, e.clientY]; svg.setPointerCapture(e.pointerId); });
  for (const end of ["pointerup", "pointercancel"]) svg.addEventListener(end, () => { held = null; });
  svg.addEventListener("pointermove", e => {
    if (!held) return;
    const per = svg.getScreenCTM().a;
    look([box[0] - (e.clientX - held[0]) / per, box[1] - (e.clientY - held[1]) / per, box[2], box[3]]);
    held = [e.clientX, e.clientY];
  });
  show(data.first);
  start(data.layers[data.first]?.marks[0]?.[0] || 0);
}

function theme(redraw) {
  const names = ["auto", "light", "dark"], button = $("theme");
  button.addEventListener("click", () => {
    const next = names[(names.indexOf(root.dataset.theme || "auto") + 1) % 3];
    if (next === "auto") delete root.dataset.theme;
    else root.dataset.theme = next;
    button.textContent = `Theme: ${next}`;
    redraw();
  });
  dark.addEventListener("change", redraw);
  for (const when of ["beforeprint", "afterprint"]) addEventListener(when, redraw);
}

content().then(data => {
  theme(model(data));
  plan(data);
  drawn();
});
