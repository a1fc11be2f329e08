"use strict";
// Light or dark, of the gallery and of the report: as the system has it, until a reader says otherwise.
(() => {
  const root = document.documentElement;
  const kept = (value) => {
    try {
      if (value) localStorage.setItem("notabug-theme", value);
      return localStorage.getItem("notabug-theme");
    } catch { return value; }
  };
  const theme = kept();
  if (theme) root.dataset.theme = theme;
  document.addEventListener("click", (event) => {
    if (!event.target.closest("#theme")) return;
    const dark = root.dataset.theme ? root.dataset.theme === "dark" : matchMedia("(prefers-color-scheme: dark)").matches;
    root.dataset.theme = dark ? "light" : "dark";
    kept(root.dataset.theme);
  });
})();
