// Figures: drawn when the page is there, in the page's own colours, again where these or a choice change.
let figures = [];
const paper = matchMedia("print");

function coloured(layout) {
  const ink = colour("--ink"), line = colour("--line");
  const clear = "rgba(0,0,0,0)";
  const dressed = {...layout, paper_bgcolor: clear, plot_bgcolor: clear, font: {color: ink, size: 12}, autosize: true,
    modebar: {bgcolor: clear, color: colour("--faint"), activecolor: ink}};
  for (const name of Object.keys(layout).filter((key) => /^[xy]axis/.test(key)))
    dressed[name] = {...layout[name], gridcolor: line, linecolor: line};
  if (layout.scene) {  // bodies are nearly black: always on light paper
    Object.assign(dressed, {paper_bgcolor: "#f3f5f7", font: {color: "#1f2328", size: 12}, scene: {...layout.scene}});
    for (const name of ["xaxis", "yaxis", "zaxis"])
      dressed.scene[name] = {...layout.scene[name], gridcolor: "#c3cad1", zerolinecolor: "#c3cad1", backgroundcolor: clear};
  }
  return dressed;
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
    const layout = coloured(parts[k]);
    place.style.minHeight = `${layout.height}px`;
    if (place.layout && place.layout.scene && layout.scene) layout.scene.camera = place.layout.scene.camera;
    const how = {responsive: true, displaylogo: false, displayModeBar: innerWidth < 600 ? false : "hover"};
    return Plotly.react(place, figure.choices[choice].data, layout, how).then(() => {
      if (!place.spaced) place.on("plotly_relayout", () => spaced(place));
      place.spaced = true;
      return spaced(place);
    });
  }));
}

// Logarithmic axes: ticks at 1, 2 and 5 where their words have room, else at whole decades; anew after a zoom.
function spaced(place) {
  const changes = {};
  for (const [name, axis] of Object.entries(place._fullLayout)) {
    if (!/^[xy]axis/.test(name) || axis.type !== "log") continue;
    const decades = Math.abs(axis.range[1] - axis.range[0]), room = axis._length / decades, word = name[0] === "x" ? 44 : 22;
    const step = decades < 1 ? undefined : room * 0.3 > word ? "D2" : Math.ceil(word / room);
    if (place.layout[name].dtick !== step) changes[`${name}.dtick`] = step ?? null;
  }
  return Object.keys(changes).length ? Plotly.relayout(place, changes) : null;
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
  drawn();
}

async function begin() {
  const content = await unpacked("content").json();
  for (const image of document.querySelectorAll("img[data-drawing]"))
    image.src = URL.createObjectURL(new Blob([content.drawings[image.dataset.drawing]], {type: "image/svg+xml"}));
  figures = content.figures;
  if (!figures.length) return drawn();
  const library = document.createElement("script");
  library.textContent = await unpacked("plotly").text();
  document.head.append(library);
  dark.addEventListener("change", all);
  paper.addEventListener("change", all);
  for (const figure of figures) {
    const select = document.querySelector(`select[data-for="${figure.key}"]`);
    if (select) select.addEventListener("change", () => choose(figure, select.selectedIndex));
  }
  return all();
}
begin();
