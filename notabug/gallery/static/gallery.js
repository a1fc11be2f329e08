"use strict";
// Filters of the matrix; their state is the address, so that a link shows what its sender saw.
(() => {
  const form = document.querySelector("[data-filters]");
  const matrix = document.querySelector("[data-matrix]");
  const exhibits = [...matrix.children];
  const names = ["q", "class", "verdict", "renderer", "finding", "sort"];
  const value = (name) => form.elements[name].value;

  function fits(tile) {
    const { verdict, renderer, findings, text } = tile.dataset;
    return (!value("verdict") || verdict === value("verdict"))
      && (!value("renderer") || renderer === value("renderer"))
      && (!value("finding") || findings.split("|").includes(value("finding")))
      && words().every((word) => `${tile.closest(".exhibit").textContent} ${text}`.toLowerCase().includes(word));
  }
  const words = () => value("q").toLowerCase().split(/\s+/).filter(Boolean);

  function apply() {
    let shown = 0, pictures = 0;
    const narrowed = ["verdict", "renderer", "finding"].some(value);
    for (const exhibit of exhibits) {
      const tiles = [...exhibit.querySelectorAll("[data-verdict]")];
      const fitting = tiles.filter(fits);
      for (const tile of tiles) tile.hidden = !fitting.includes(tile);
      const plain = words().every((word) => exhibit.textContent.toLowerCase().includes(word));
      exhibit.hidden = (value("class") && exhibit.dataset.class !== value("class"))
        || !(fitting.length || (!narrowed && !tiles.length && plain));
      if (!exhibit.hidden) { shown += 1; pictures += fitting.length; }
    }
    const key = value("sort") === "name" ? (each) => each.dataset.name : (each) => each.dataset.rank.padStart(6, "0");
    matrix.append(...[...exhibits].sort((p, q) => key(p).localeCompare(key(q))));
    form.querySelector("[data-count]").textContent = `${shown} of ${exhibits.length} scenes, ${pictures} pictures`;
    document.querySelector("[data-none]").hidden = shown > 0;
  }
  function toAddress() {
    const state = new URLSearchParams(names.filter((name) => value(name)).map((name) => [name, value(name)]));
    history.replaceState(null, "", `#${state}`);
  }
  function fromAddress() {
    const state = new URLSearchParams(location.hash.slice(1));
    for (const name of names) form.elements[name].value = state.get(name) ?? "";
    for (const each of form.querySelectorAll("select")) if (each.selectedIndex < 0) each.selectedIndex = 0;
    apply();
  }
  form.addEventListener("submit", (event) => event.preventDefault());
  form.addEventListener("input", () => { apply(); toAddress(); });
  document.querySelector("[data-reset]").addEventListener("click", () => { form.reset(); apply(); toAddress(); });
  addEventListener("hashchange", fromAddress);
  fromAddress();
})();
