"use strict";
// Figures: drawn when the page is there, in the page's own colours, again where these or a choice change.
const figures = JSON.parse(document.getElementById("figures").textContent);
const dark = matchMedia("(prefers-color-scheme: dark)");
const paper = matchMedia("print");
const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();

function dressed(layout) {
  const ink = colour("--ink"), line = colour("--line");
  const clear = "rgba(0,0,0,0)";
  const made = {...layout, paper_bgcolor: clear, plot_bgcolor: clear, font: {color: ink, size: 12}, autosize: true,
    modebar: {bgcolor: clear, color: colour("--faint"), activecolor: ink}};
  for (const name of Object.keys(layout).filter((key) => /^[xy]axis/.test(key)))
    made[name] = {...layout[name], gridcolor: line, linecolor: line};
  if (layout.scene) {  // bodies are nearly black: always on light paper
    Object.assign(made, {paper_bgcolor: "#f3f5f7", font: {color: "#1f2328", size: 12}, scene: {...layout.scene}});
    for (const name of ["xaxis", "yaxis", "zaxis"])
      made.scene[name] = {...layout.scene[name], gridcolor: "#c3cad1", zerolinecolor: "#c3cad1", backgroundcolor: clear};
  }
  return made;
}

// Paper ends where a screen scrolls: a figure of many rows is drawn in pieces of one page, over the same x axis.
const ROWS = 28;
function pieces(layout) {
  const count = layout.yaxis?.categoryarray?.length ?? 0;
  if (!paper.matches || count <= ROWS) return [layout];
  const many = Math.ceil(count / ROWS), each = Math.ceil(count / many);
  return Array.from({length: many}, (_, k) => {
    const first = k * each, last = Math.min(first + each, count);
    const height = layout.height * (last - first) / count + 110 * (1 - (last - first) / count);
    return {...layout, height, yaxis: {...layout.yaxis, range: [last - 0.5, first - 0.5]}};
  });
}

function places(key, count) {
  const first = document.querySelector(`.plot[data-key="${key}"]`);
  for (const more of document.querySelectorAll(`.more[data-of="${key}"]`)) { Plotly.purge(more); more.remove(); }
  const rest = Array.from({length: count - 1}, () => Object.assign(document.createElement("div"), {className: "plot more"}));
  for (const more of rest) more.dataset.of = key;
  first.after(...rest);
  first.closest("figure").classList.toggle("parted", count > 1);
  return [first, ...rest];
}

function draw(figure, choice = 0) {
  const parts = pieces(figure.choices[choice].layout);
  return Promise.all(places(figure.key, parts.length).map((place, k) => {
    const layout = dressed(parts[k]);
    place.style.minHeight = `${layout.height}px`;
    if (place.layout && place.layout.scene && layout.scene) layout.scene.camera = place.layout.scene.camera;
    return Plotly.react(place, figure.choices[choice].data, layout, {responsive: true, displaylogo: false, displayModeBar: innerWidth < 600 ? false : "hover"});
  }));
}

const chosen = (figure) => {
  const select = document.querySelector(`select[data-for="${figure.key}"]`);
  return select ? select.selectedIndex : 0;
};
// A choice holds for all figures that have the same ones: all maps show one frequency.
function choose(figure, choice) {
  const names = (other) => other.chooser + other.choices.map((one) => one.name).join();
  for (const other of figures.filter((other) => names(other) === names(figure))) {
    document.querySelector(`select[data-for="${other.key}"]`).selectedIndex = choice;
    draw(other, choice);
  }
}
async function all() {
  document.documentElement.removeAttribute("data-drawn");
  await Promise.all(figures.map((figure) => draw(figure, chosen(figure))));
  document.documentElement.setAttribute("data-drawn", "yes");
}

if (figures.length) {
  all();
  dark.addEventListener("change", all);
  paper.addEventListener("change", all);
  for (const figure of figures) {
    const select = document.querySelector(`select[data-for="${figure.key}"]`);
    if (select) select.addEventListener("change", () => choose(figure, select.selectedIndex));
  }
} else document.documentElement.setAttribute("data-drawn", "yes");

// Tables: a head is a button that sorts by its column, numbers by their value, nothing last.
const value = (cell) => {
  if (!("value" in cell.dataset)) return cell.textContent;
  const said = cell.dataset.value;
  return said === "" ? null : said === "inf" ? Infinity : Number(said);
};
function compare(a, b, sign) {
  if (a === null || b === null) return (a === null) - (b === null);
  if (typeof a === "number" && typeof b === "number") return sign * (a - b || 0);
  return sign * String(a).localeCompare(String(b), "en", {numeric: true});
}
for (const head of document.querySelectorAll("thead th:has(button)")) {
  head.querySelector("button").addEventListener("click", () => {
    const rising = head.getAttribute("aria-sort") !== "ascending";
    for (const other of head.parentNode.children) other.setAttribute("aria-sort", "none");
    head.setAttribute("aria-sort", rising ? "ascending" : "descending");
    const body = head.closest("table").tBodies[0], column = head.cellIndex;
    const rows = [...body.rows].map((row) => [value(row.cells[column]), row]);
    rows.sort((a, b) => compare(a[0], b[0], rising ? 1 : -1));
    body.append(...rows.map((row) => row[1]));
  });
}
