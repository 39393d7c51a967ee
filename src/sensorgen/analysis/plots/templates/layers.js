const stack = document.getElementById("stack"), slider = document.getElementById("layer");
const groups = [...stack.querySelectorAll("g")], whole = stack.getAttribute("viewBox").split(" ").map(Number);
let view = [...whole], held = null;
function show(k) {
  slider.value = k;
  groups.forEach((g, n) => { g.setAttribute("class", n === k ? "now" : n === k - 1 ? "below" : ""); });
  document.getElementById("said").textContent = groups[k].dataset.title;
}
function look(to) { view = to; stack.setAttribute("viewBox", view.join(" ")); }
function at(event) {
  return new DOMPoint(event.clientX, event.clientY).matrixTransform(stack.getScreenCTM().inverse());
}
slider.addEventListener("input", () => show(Number(slider.value)));
document.getElementById("whole").addEventListener("click", () => look([...whole]));
document.querySelectorAll("[data-layer]").forEach(b => b.addEventListener("click", () => {
  show(Number(b.dataset.layer));
  stack.scrollIntoView();
}));
document.querySelectorAll(".key input").forEach(box => box.addEventListener("change", () => {
  stack.querySelectorAll(".b" + box.value).forEach(p => { p.style.display = box.checked ? "" : "none"; });
}));
stack.addEventListener("wheel", event => {
  event.preventDefault();
  const p = at(event), f = Math.min(Math.max(Math.exp(event.deltaY / 500), .5), 2);
  if (view[2] * f > 4 * whole[2] || view[2] * f < .1) return;
  look([p.x - (p.x - view[0]) * f, p.y - (p.y - view[1]) * f, view[2] * f, view[3] * f]);
}, { passive: false });
stack.addEventListener("pointerdown", event => { held = at(event); stack.setPointerCapture(event.pointerId); });
stack.addEventListener("pointerup", () => { held = null; });
stack.addEventListener("pointermove", event => {
  if (!held) return;
  const p = at(event);
  look([view[0] + held.x - p.x, view[1] + held.y - p.y, view[2], view[3]]);
});
show(Number(slider.value));
drawn();
