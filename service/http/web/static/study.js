// Pages of a study: choices take effect immediately, and a running study shows its progress. The server makes every part.
"use strict";

// A form with data-swap: a change shows the new page's part, and puts its address into the window.
for (const form of document.querySelectorAll("form[data-swap]")) {
  let latest = 0, asked = null;
  const swap = async () => {
    const mine = ++latest;
    const chosen = new URLSearchParams([...new FormData(form)].filter(([, value]) => value !== ""));
    const address = asked = `${location.pathname}?${chosen}`;
    const old = document.querySelector(form.dataset.swap);
    old.classList.add("stale"); // it does not match the current choices
    let page = null;
    try {
      page = await sprag.page(address);
    } catch (error) {
      if (mine === latest && !(error instanceof sprag.LostError)) { asked = null; sprag.say(old, error.message); old.classList.remove("stale"); }
      return;
    }
    if (mine !== latest) return;
    asked = null;
    const focused = document.activeElement;
    const place = focused && focused.name ? [focused.name, focused.value] : null;
    const part = sprag.take(page, form.dataset.swap);
    part.classList.remove("stale");
    if (!(focused && focused.closest && focused.closest("#held"))) sprag.take(page, "#held");
    const summary = form.querySelector("details.results summary"), fresh = page.querySelector("details.results summary");
    if (summary && fresh) summary.textContent = fresh.textContent;
    history.replaceState(null, "", address);
    if (place && document.activeElement === document.body) {
      const again = form.elements.namedItem(place[0]);
      if (again && again.focus) again.focus();
    }
    if (window.Plotly) await sprag.drawAll(part);
  };
  form.addEventListener("change", swap);
  document.addEventListener("sprag:found", () => { if (asked) swap(); });
}

// A running study: each progress event updates the page, at most once a second.
const running = document.querySelector("[data-events]");
if (running) {
  const address = running.dataset.events;
  let source = null, timer = null, lastDrawn = 0, ended = false;
  const refresh = async () => {
    timer = null;
    const last = ended, here = location.href;
    const page = await sprag.page(here).catch(() => null);
    if (!page || here !== location.href) return;
    for (const part of ["#head", "#progress", "#tiles", "#family", "#endings", "#particulars"]) sprag.take(page, part);
    if (!last && Date.now() - lastDrawn < 3000) return;
    lastDrawn = Date.now();
    if (!document.querySelector(".stale")) sprag.take(page, "#cases");
    for (const plot of document.querySelectorAll(".plot[data-figure]")) if (window.Plotly) sprag.draw(plot);
  };
  const listen = () => {
    source = new EventSource(address);
    source.addEventListener("progress", () => { timer = timer || setTimeout(refresh, 700); });
    source.addEventListener("end", () => { ended = true; source.close(); clearTimeout(timer); refresh(); });
    // A stream ends when the service stops or the connection is cut; a request shows which.
    source.addEventListener("error", () => { if (!ended) sprag.fetch("/livez", { cache: "no-store" }).catch(() => {}); });
  };
  document.addEventListener("sprag:found", () => {
    if (!ended && source.readyState === EventSource.CLOSED) listen();
    lastDrawn = 0;
    refresh();
  });
  listen();
}
