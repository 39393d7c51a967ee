// Layers as printed: one at a time over the one below, with places of findings; for every page of a print.
const $ = name => document.getElementById(name), root = document.documentElement;
const each = (words, what) => document.querySelectorAll(words).forEach(what);


// The buttons of the findings: each calls `go` with the number of its finding, which is then the chosen one.
function marked(data, go) {
  each("[data-finding]", button => button.addEventListener("click", () => {
    each(".listed .now", other => other.classList.remove("now"));
    button.closest("li").classList.add("now");
    go(Number(button.dataset.finding), button.dataset.to);
  }));
}

function plan(data) {
  const svg = $("plan"), slider = $("layer"), [length, width] = data.size;
  const node = (kind, has, title) => {
    const made = document.createElementNS("http://www.w3.org/2000/svg", kind);
    for (const [name, value] of Object.entries(has)) made.setAttribute(name, value);
    if (title) made.append(Object.assign(node("title", {}), { textContent: title }));
    return made;
  };
  const words = kind => [...document.querySelectorAll(`.key .${kind}`)].map(box => box.parentNode.querySelector("span").textContent);
  const bodies = words("body"), travel = words("travel"), boxes = [...document.querySelectorAll(".key .travel")];
  let box = [0, 0, 1, 1], chosen = -1;
  function look(to) {
    box = to;
    svg.setAttribute("viewBox", box.join(" "));
  }
  function start(x) {
    const tall = 1.12 * width, wide = Math.min(tall * svg.clientWidth / Math.max(svg.clientHeight, 1), 1.04 * length);
    look([Math.min(Math.max((x || 0) - wide / 2, -0.02 * wide), Math.max(1.02 * length - wide, -0.02 * wide)),
      -0.06 * width, wide, tall]);
  }
  function layer(k, group) {
    const made = node("g", { class: group }), at = data.layers[k];
    for (const [body, d] of Object.entries(at.paths))
      if (document.querySelector(`.body[value="${body}"]`).checked) made.append(node("path", { class: `b${body}`, d }, bodies[body]));
    at.ways.forEach((d, n) => {
      if (d && group === "now" && boxes[n].checked) made.append(node("path", { class: "way", style: `stroke: ${boxes[n].dataset.colour}`, d }, travel[n]));
    });
    return made;
  }
  function show(k) {
    const at = data.layers[k];
    if (!at) return;
    slider.value = k;
    const here = data.findings.map((found, number) => [found, number]).filter(([found]) => found && found[0] === k);
    svg.replaceChildren(...(k ? [layer(k - 1, "below")] : []), layer(k, "now"), ...here.map(([[, x, y, , text], number]) =>
      node("circle", { class: number === chosen ? "mark now" : "mark", cx: x, cy: width - y, r: width / 16 }, text)));
    $("layer-at").textContent = `${k + 1} of ${data.layers.length}: ${at.z[0]} to ${at.z[1]} mm`;
    slider.setAttribute("aria-valuetext", $("layer-at").textContent);
  }
  const again = () => show(Number(slider.value));
  function zoom(f, [x, y] = [box[0] + box[2] / 2, box[1] + box[3] / 2]) {
    const [left, top, w, h] = box;
    if (w * f < 0.05 * width || w * f > 4 * length) return;
    look([x - (x - left) * f, y - (y - top) * f, w * f, h * f]);
  }
  slider.addEventListener("input", again);
  each(".key input", input => input.addEventListener("input", again));
  each("[data-plan]", b => b.addEventListener("click", () => {
    if (b.dataset.plan === "whole") look([-0.02 * length, -0.06 * width, 1.04 * length, 1.12 * width]);
    else zoom(b.dataset.plan === "in" ? 0.6 : 1 / 0.6);
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
  svg.addEventListener("wheel", e => { // the page scrolls unless the plan has the focus
    if (document.activeElement !== svg && !e.ctrlKey) return;
    e.preventDefault();
    const at = new DOMPoint(e.clientX, e.clientY).matrixTransform(svg.getScreenCTM().inverse());
    zoom(Math.exp(e.deltaY / 500), [at.x, at.y]);
  }, { passive: false });
  let from = null;
  svg.addEventListener("pointerdown", e => { from = [e.clientX, e.clientY]; svg.setPointerCapture(e.pointerId); });
  for (const end of ["pointerup", "pointercancel"]) svg.addEventListener(end, () => { from = null; });
  svg.addEventListener("pointermove", e => {
    if (!from) return;
    const per = svg.getScreenCTM().a;
    look([box[0] - (e.clientX - from[0]) / per, box[1] - (e.clientY - from[1]) / per, box[2], box[3]]);
    from = [e.clientX, e.clientY];
  });
  show(data.first);
  start(data.findings.find(found => found && found[0] === data.first)?.[1]);
  return (number, to = "plan") => {
    chosen = number;
    show(data.findings[number][0]);
    start(data.findings[number][1]);
    if (to !== "plan") return;
    svg.scrollIntoView({ block: "center" });
    slider.focus({ preventScroll: true });
  };
}
