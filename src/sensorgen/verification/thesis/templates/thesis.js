const form = document.querySelector("form");
const rows = [...document.querySelectorAll("tr[data-verdict]")];
const heads = [...document.querySelectorAll("tr.chapter")];
function show() {
  const wanted = Object.fromEntries(new FormData(form));
  const text = wanted.text.trim().toLowerCase();
  const used = new Set();
  let count = 0;
  for (const row of rows) {
    const fits = ["chapter", "kind", "verdict"].every((key) => !wanted[key] || row.dataset[key] === wanted[key])
      && (!text || row.textContent.toLowerCase().includes(text));
    row.hidden = !fits;
    if (fits) { count += 1; used.add(row.dataset.chapter); }
  }
  for (const head of heads) head.hidden = !used.has(head.dataset.chapter);
  form.elements.count.value = `${count} of ${rows.length} shown`;
}
form.addEventListener("input", show);
form.addEventListener("reset", () => setTimeout(show));
form.addEventListener("submit", (event) => event.preventDefault());
for (const [key, value] of new URLSearchParams(location.search)) {
  if (form.elements[key]) form.elements[key].value = value;
}
form.hidden = false;
show();
