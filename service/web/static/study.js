// Pages of a study: choices take effect at once, and a study that runs tells how far it is. Every part is the server's own.
"use strict";

const pageOf = async (address) => {
  const answer = await fetch(address, { headers: { Accept: "text/html" } });
  return new DOMParser().parseFromString(await answer.text(), "text/html");
};

const take = (page, selector) => {
  const mine = document.querySelector(selector), theirs = page.querySelector(selector);
  if (mine && theirs) mine.replaceWith(document.adoptNode(theirs));
  return document.querySelector(selector);
};

// A form with data-swap: a change shows the new page's part, and puts its address into the window.
for (const form of document.querySelectorAll("form[data-swap]")) {
  let latest = 0;
  form.addEventListener("change", async () => {
    const mine = ++latest;
    const chosen = new URLSearchParams([...new FormData(form)].filter(([, value]) => value !== ""));
    const address = `${location.pathname}?${chosen}`;
    const page = await pageOf(address);
    if (mine !== latest) return;
    const focused = document.activeElement;
    const place = focused && focused.name ? [focused.name, focused.value] : null;
    const part = take(page, form.dataset.swap);
    if (!(focused && focused.closest && focused.closest("#held"))) take(page, "#held");
    const summary = form.querySelector("details.results summary"), fresh = page.querySelector("details.results summary");
    if (summary && fresh) summary.textContent = fresh.textContent;
    history.replaceState(null, "", address);
    if (place && document.activeElement === document.body) {
      const again = form.elements.namedItem(place[0]);
      if (again && again.focus) again.focus();
    }
    if (window.Plotly) await sprag.drawAll(part);
  });
}

// A study that runs: each event of its progress brings the page's own words up to date, at most once a second.
const running = document.querySelector("[data-events]");
if (running) {
  const source = new EventSource(running.dataset.events);
  let timer = null, lastDrawn = 0;
  const refresh = async (ended) => {
    timer = null;
    const page = await pageOf(location.href);
    for (const part of ["#head", "#progress", "#endings", "#particulars"]) {
      const inside = document.querySelector(part);
      if (inside && inside.contains(document.activeElement)) {
        const index = [...inside.querySelectorAll("a,button")].indexOf(document.activeElement);
        const fresh = take(page, part).querySelectorAll("a,button");
        if (fresh[index]) fresh[index].focus();
      } else take(page, part);
    }
    if (ended || Date.now() - lastDrawn > 3000) {
      lastDrawn = Date.now();
      for (const plot of document.querySelectorAll(".plot[data-live]")) if (window.Plotly) sprag.draw(plot);
    }
  };
  source.addEventListener("progress", () => { timer = timer || setTimeout(refresh, 700, false); });
  source.addEventListener("end", () => { source.close(); clearTimeout(timer); refresh(true); });
}
