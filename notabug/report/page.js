"use strict";
// Filters rows and what they leave empty, opens what an address names, copies commands, enlarges pictures, takes keys.
(() => {
  const all = (selector, from = document) => [...from.querySelectorAll(selector)];
  const byId = (id) => document.getElementById(id);
  const rows = all(".row");
  const data = byId("pictures");
  const embedded = data ? JSON.parse(data.textContent) : {};

  // Pictures of a single file are decoded when they come near the window.
  const fill = (image) => {
    if (image.dataset.picture) image.src = embedded[image.dataset.picture];
    delete image.dataset.picture;
  };
  const near = new IntersectionObserver((seen) => seen.forEach(({ isIntersecting, target }) => {
    if (isIntersecting) {
      fill(target);
      near.unobserve(target);
    }
  }), { rootMargin: "400px" });
  all("img[data-picture]").forEach((image) => near.observe(image));

  // The filter: a row that does not fit is hidden, and so is whatever holds no row that fits.
  const form = document.querySelector(".filter");
  const filter = () => {
    const words = new Set(all("[name=word]:checked", form).map((box) => box.value));
    const asked = byId("search").value.toLowerCase().split(/\s+/).filter(Boolean);
    const renderer = byId("renderer").value;
    const changed = byId("changed").checked;
    let shown = 0;
    for (const row of rows) {
      const { word, renderer: own, changed: change, text } = row.dataset;
      const fits = words.has(word) && (!renderer || own === renderer) && (!changed || change.trim())
        && asked.every((each) => text.includes(each));
      row.hidden = !fits;
      shown += fits;
    }
    for (const holder of all(".same, .cause-group, .cause-group > .alike, .group")) holder.hidden = !holder.querySelector(".row:not([hidden])");
    for (const group of all(".group")) {
      const here = all(".row:not([hidden])", group).length;
      const every = all(".row", group).length;
      const count = group.querySelector(".count");
      count.textContent = here !== every ? `${here} of ${every}` : "plain" in count.dataset ? "" : every;
    }
    for (const link of all(".changes a")) link.hidden = Boolean(byId(link.hash.slice(1))?.hidden);
    byId("none").hidden = shown > 0;
    byId("shown").textContent = shown === rows.length ? "" : `${shown} of ${rows.length} shown`;
    document.body.classList.toggle("unboxed", !byId("boxes").checked);
  };
  const unfold = (narrowed) => all(".group").forEach((group) => {
    if (narrowed && !group.hidden) group.open = true;
  });
  const reset = () => {
    all("[name=word]", form).forEach((box) => { box.checked = true; });
    byId("search").value = byId("renderer").value = "";
    byId("changed").checked = false;
    filter();
  };
  form.addEventListener("input", () => {
    filter();
    unfold(byId("search").value || byId("changed").checked);
  });
  form.addEventListener("submit", (event) => event.preventDefault());
  byId("all").addEventListener("click", reset);
  all("button.only").forEach((button) => button.addEventListener("click", () => {
    reset();
    all("[name=word]", form).forEach((box) => { box.checked = box.value === button.dataset.word; });
    byId("renderer").value = button.dataset.renderer;
    filter();
    unfold(true);
    all(".same:not([hidden]) > .alike").forEach((each) => { each.open = true; });
    byId("main").scrollIntoView();
  }));

  // The address of a row opens all that it lies in.
  let at = null;
  const go = (row, scroll = true) => {
    if (row.hidden) reset();
    for (let holder = row; holder; holder = holder.parentElement) if (holder.tagName === "DETAILS") holder.open = true;
    if (at) at.classList.remove("at");
    at = row;
    at.classList.add("at");
    if (scroll) row.scrollIntoView({ block: "start" });
    (row.querySelector(":scope > summary") ?? row).focus({ preventScroll: true });
  };
  const follow = () => {
    let id = location.hash.slice(1);
    try { id = decodeURIComponent(id); } catch { return; }
    const row = byId(id);
    if (row?.matches(".row")) go(row);
  };
  addEventListener("hashchange", follow);

  // Copying works from disk too, where a browser may have no clipboard to give.
  const copy = async (button) => {
    const code = button.parentElement.querySelector("code");
    try {
      await navigator.clipboard.writeText(code.textContent);
    } catch {
      getSelection().selectAllChildren(code);
      document.execCommand("copy");
    }
    button.textContent = "copied";
    setTimeout(() => { button.textContent = "copy"; }, 1500);
  };

  // The viewer: a result's pictures, all at the same place, so that going through them shows what moves.
  const viewer = byId("viewer");
  const big = viewer.querySelector("img");
  const tabs = viewer.querySelector("nav");
  let pictures = [];
  let picked = 0;
  const show = (index) => {
    picked = (index + pictures.length) % pictures.length;
    fill(pictures[picked]);
    big.src = pictures[picked].src;
    big.alt = pictures[picked].alt;
    viewer.querySelector("figcaption").textContent = big.alt;
    [...tabs.children].forEach((tab, i) => tab.setAttribute("aria-pressed", i === picked));
    tabs.children[picked].focus();
  };
  const enlarge = (row, image) => {
    pictures = all(".zoom img", row);
    if (!pictures.length) return;
    tabs.replaceChildren(...pictures.map((each, i) => {
      const tab = document.createElement("button");
      tab.type = "button";
      tab.textContent = `${i + 1} ${each.dataset.title}`;
      tab.addEventListener("click", () => show(i));
      return tab;
    }));
    viewer.showModal();
    show(Math.max(0, pictures.indexOf(image)));
  };
  viewer.addEventListener("keydown", (event) => {
    if (event.key === "ArrowRight") show(picked + 1);
    else if (event.key === "ArrowLeft") show(picked - 1);
    else if (event.key >= "1" && event.key <= String(pictures.length)) show(Number(event.key) - 1);
  });

  document.addEventListener("click", (event) => {
    const zoom = event.target.closest("button.zoom");
    const copier = event.target.closest("button.copy");
    const dialog = event.target.closest("dialog");
    if (zoom) enlarge(zoom.closest(".row"), zoom.querySelector("img"));
    else if (copier) copy(copier);
    else if (dialog && (event.target === dialog || event.target.closest(".close"))) dialog.close();
  });
  byId("help").addEventListener("click", () => byId("legend").showModal());

  document.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey || document.querySelector("dialog[open]")) return;
    if (event.target.matches("input[type=search], select")) {
      if (event.key === "Escape") event.target.blur();
      return;
    }
    const seen = rows.filter((row) => !row.hidden && row.checkVisibility());
    const here = seen.indexOf(at);
    if (event.key === "j" && seen.length) go(seen[Math.min(here + 1, seen.length - 1)]);
    else if (event.key === "k" && seen.length) go(seen[Math.max(here - 1, 0)]);
    else if (event.key === "o" && at?.tagName === "DETAILS") at.open = !at.open;
    else if (event.key === "c" && at) at.querySelector(".copy")?.click();
    else if (event.key === "z" && at) enlarge(at, null);
    else if (event.key === "/") {
      event.preventDefault();
      byId("search").focus();
    } else if (event.key === "?") byId("legend").showModal();
  });
  filter();
  follow();
})();
