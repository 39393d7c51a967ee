"use strict";
// For every page: its colours, what is packed in it, tables that sort, and the sign that all is drawn.
const dark = matchMedia("(prefers-color-scheme: dark)");
const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
const drawn = () => document.documentElement.setAttribute("data-drawn", "yes");

function unpacked(name) {
  const bytes = Uint8Array.from(atob(document.getElementById(name).textContent), (c) => c.charCodeAt(0));
  return new Response(new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip")));
}

// Tables: a head is a button that sorts by its column, numbers by their value, nothing last.
const value = (cell) => {
  if (!("value" in cell.dataset)) return cell.textContent;
  const text = cell.dataset.value;
  return text === "" ? null : text === "inf" ? Infinity : Number(text);
};
function compare(a, b, sign) {
  if (a === null || b === null) return (a === null) - (b === null);
  if (typeof a === "number" && typeof b === "number") return sign * (a - b || 0);
  return sign * String(a).localeCompare(String(b), "en", {numeric: true});
}
for (const head of document.querySelectorAll("[data-table]:not(.fixed table) thead th")) {
  if (!head.textContent.trim()) continue;
  const button = Object.assign(document.createElement("button"), {type: "button"});
  button.append(...head.childNodes);
  head.append(button);
  head.setAttribute("aria-sort", "none");
  button.addEventListener("click", () => {
    const rising = head.getAttribute("aria-sort") !== "ascending";
    for (const other of head.parentNode.children) other.setAttribute("aria-sort", "none");
    head.setAttribute("aria-sort", rising ? "ascending" : "descending");
    const body = head.closest("table").tBodies[0], column = head.cellIndex;
    const rows = [...body.rows].map((row) => [value(row.cells[column]), row]);
    rows.sort((a, b) => compare(a[0], b[0], rising ? 1 : -1));
    body.append(...rows.map((row) => row[1]));
  });
}
