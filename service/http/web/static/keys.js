// Keyboard shortcuts: g and a letter for the pages, digits for the parts of a study, / for the search of studies, F1 for the explanation
// of a field, ? for this help.
"use strict";

(() => {
  const OFF = "sprag.keys.off", WAIT = 1500; // ms in which the letter follows g
  const dialog = document.querySelector("#keys"), list = dialog.querySelector("dl"), on = dialog.querySelector("[type=checkbox]");
  let waiting = 0;
  on.checked = localStorage.getItem(OFF) === null;
  on.addEventListener("change", () => { on.checked ? localStorage.removeItem(OFF) : localStorage.setItem(OFF, "1"); });

  const withKey = (prefix, key) => [...document.querySelectorAll(prefix)].find((link) => link.dataset.key === key);
  const PAGES = "header.site [data-key], footer.site [data-key]", PARTS = "main [data-key]";
  // The shortcuts that a key may mean: its own, and under a layout that has no Latin letter on it, that at its place on a US keyboard.
  const meant = ({ key, code, shiftKey }) => {
    const place = code === "Slash" ? (shiftKey ? "?" : "/") : !shiftKey && /^(?:Key|Digit)(.)$/.exec(code)?.[1].toLowerCase();
    return /^[a-z]$/i.test(key) || !place ? [key] : [key, place];
  };
  const find = document.querySelector("header.site [type=search]");

  const help = () => {
    list.querySelectorAll(".link").forEach((item) => item.remove());
    for (const [prefix, before] of [[PAGES, "g "], [PARTS, ""]]) {
      for (const link of document.querySelectorAll(prefix)) {
        const key = document.createElement("dt"), name = document.createElement("dd"), shown = document.createElement("kbd");
        shown.textContent = before + link.dataset.key;
        name.textContent = link.textContent;
        key.className = name.className = "link";
        key.append(shown);
        list.append(key, name);
      }
    }
    dialog.showModal();
  };

  document.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey || event.defaultPrevented || dialog.open) return;
    if (event.target.closest("input:not([type=checkbox], [type=radio]), select, textarea, [contenteditable]")) return;
    if (!on.checked) return;
    const after = waiting > event.timeStamp;
    waiting = 0;
    const taken = meant(event).some((key) => {
      const link = withKey(after ? PAGES : PARTS, key);
      if (link) link.click();
      else if (key === "g") waiting = event.timeStamp + WAIT;
      else if (key === "?") help();
      else if (key === "/") { find.focus(); find.select(); }
      else return false;
      return true;
    });
    if (taken) event.preventDefault();
  });

  // F1 opens the explanation of the current field, whose link stands in the line that explains it.
  document.addEventListener("keydown", (event) => {
    const link = event.key === "F1" && event.target.dataset?.more && document.querySelector("#explain a");
    if (!link) return;
    event.preventDefault();
    link.click();
  });
  document.querySelector("#keys-help").addEventListener("click", help);
})();
