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
  let paint = solidPainter(canvas), asked = false, last = "detail", spot = null;
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
    $("spot").hidden = !spot;
    if (!spot) return;
    const [right, up] = axes(view), off = spot.map((v, k) => v - view.centre[k]);
    $("spot").style.left = `${canvas.clientWidth / 2 + dot(right, off) * view.scale / view.pixels}px`;
    $("spot").style.top = `${canvas.clientHeight / 2 - dot(up, off) * view.scale / view.pixels}px`;
  }
  // A place with a circle around it, the bodies cut there
  function mark(place) {
    spot = place;
    $("axis").value = "1";
    $("cut").value = place[1] / size[1] * 1000;
    $("lift").value = 0;
    [view.turn, view.tilt] = VIEWS.detail;
    view.centre = place;
    view.scale = fitting(view, [0, 0, 0], size.map(side => Math.min(side, 5 * size[2])), canvas.width, canvas.height);
    last = "";
    ask();
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
  return { ask, mark };
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

// A finding in its three views: the model, the section with the drawing, and the layers.
function views(data, go, model) {
  marked(data, (number, to) => {
    const [, x, y, z, words, balloon] = data.findings[number], place = [x, y, z];
    go(number, to);
    model.mark(place);
    each(".section", svg => {
      const { across, start, end, top } = svg.dataset, spot = svg.querySelector(".spot"), along = place[across];
      spot.toggleAttribute("hidden", along < start || along > end);
      spot.setAttribute("cx", along - start);
      spot.setAttribute("cy", top - z);
      spot.firstElementChild.textContent = words;
    });
    $("sheet").shadowRoot.querySelectorAll(".marker, .entry").forEach(marker =>
      marker.classList.toggle("now", marker.dataset.number === String(balloon)));
    if (to === "model") $("model").scrollIntoView({ block: "center" });
    if (to === "sheet") {
      $("sheet").parentNode.open = true;
      $("sheet").scrollIntoView({ block: "center" });
    }
  });
}

content().then(data => {
  const solid = model(data);
  theme(solid.ask);
  views(data, plan(data), solid);
  drawn();
});
