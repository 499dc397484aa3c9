// The page of rows without loading it anew: links and forms of the page show only its changed part, arrow keys choose a row,
// a drag along an axis fills in the form for a condition.
"use strict";

(() => {
  const part = () => document.querySelector("#rows"), LEAST = 4; // px: a shorter drag is a click
  let latest = 0, shown = location.search;

  // The part of the page at an address takes the place of the present one, as an entry of the history or not.
  const show = async (address, { push = false, only = "#rows" } = {}) => {
    const mine = ++latest, old = part();
    old.classList.add("stale");
    try {
      const page = await sprag.busy(old, sprag.page(address));
      if (mine !== latest) return;
      const fresh = page.querySelector("#rows");
      if (!fresh) { location.assign(address); return; }
      if (push !== null) history[push ? "pushState" : "replaceState"](null, "", fresh.dataset.address);
      sprag.take(page, only);
      if (only !== "#rows") { old.dataset.address = fresh.dataset.address; sprag.take(page, "#view-query"); }
      shown = location.search;
      stops();
    } catch (error) {
      if (mine === latest && !(error instanceof sprag.LostError)) sprag.note(old, error.message, () => show(address, { push }));
    } finally {
      part().classList.remove("stale");
    }
  };
  const here = (address) => new URL(address, location.href).pathname === location.pathname;

  document.addEventListener("click", (event) => {
    const line = event.target.closest?.("#rows svg [data-case]"), row = line && rowOf(line.dataset.case);
    const link = event.target.closest?.("#rows a[href]");
    if (event.ctrlKey || event.metaKey || event.shiftKey || event.defaultPrevented) return; // a tab or window of its own
    if (line) { event.preventDefault(); choose(row, line.dataset.case); return; }
    if (!link) return;
    const address = link.getAttribute("href");
    if (!address.startsWith("?")) return;
    event.preventDefault();
    if (link.closest("tbody") && link.closest("tr").dataset.case) choose(link.closest("tr"));
    else show(address, { push: true });
  });
  document.addEventListener("submit", (event) => {
    const form = event.target, button = event.submitter;
    if (!form.closest("#rows") || form.method !== "get" || (button?.hasAttribute("formaction") && !here(button.formAction))
      || button?.formMethod === "post") return;
    event.preventDefault();
    const chosen = new URLSearchParams([...new FormData(form, button)].filter(([name, value]) => value !== "" || name === "where"));
    show(`${location.pathname}?${chosen}`, { push: true });
  });
  window.addEventListener("popstate", () => { if (location.search !== shown) show(location.href, { push: null }); });

  // A row is marked at once; its pane follows. One link of the table is a stop of the Tab key: that of the chosen row.
  const rowOf = (number) => document.querySelector(`#rows tbody tr[data-case="${CSS.escape(number)}"]`);
  const linkOf = (row) => row.querySelector("a");
  const stops = () => {
    const rows = [...document.querySelectorAll("#rows tbody tr[data-case]")], on = rows.find((row) => row.matches(".on")) ?? rows[0];
    for (const row of rows) linkOf(row).tabIndex = row === on ? 0 : -1;
  };
  const mark = (number) => {
    for (const old of document.querySelectorAll("#rows .on")) { old.classList.remove("on"); old.removeAttribute("aria-current"); }
    const row = rowOf(number), line = document.querySelector(`#rows svg [data-case="${CSS.escape(number)}"]`);
    row?.classList.add("on");
    row?.setAttribute("aria-current", "true");
    if (line) { line.classList.add("on"); line.parentNode.insertBefore(line, line.parentNode.querySelector("g[data-name]")); }
  };
  const choose = (row, number = row.dataset.case) => {
    mark(number);
    stops();
    if (row) linkOf(row).focus({ preventScroll: false });
    const address = new URL(part().dataset.address, location.href);
    address.searchParams.set("row", number);
    show(address.href, { only: "#pane" });
  };
  // Beyond the ends of the page: its neighbour, with the nearest row.
  const turn = (key) => {
    const link = document.querySelector(`#rows .tools a[rel="${{ ArrowDown: "next", ArrowUp: "prev" }[key]}"]`);
    if (!link) return false;
    const address = new URL(link.href);
    if (link.dataset.row) address.searchParams.set("row", link.dataset.row);
    show(address.href, { push: true }).then(() => document.querySelector("#rows tbody tr.on a")?.focus());
    return true;
  };
  document.addEventListener("keydown", (event) => {
    const { key, target } = event, row = target.closest?.("#rows tbody tr[data-case]");
    const on = row ?? (target === document.body ? document.querySelector("#rows tbody tr.on") : null);
    if (!on || event.ctrlKey || event.metaKey || event.altKey || event.shiftKey) return;
    const next = key === "ArrowDown" ? on.nextElementSibling : key === "ArrowUp" ? on.previousElementSibling : null;
    if (next?.dataset.case) choose(next);
    else if (key.startsWith("Arrow")) { if (!turn(key)) return; }
    else if (key !== "Enter" || !target.matches("a, body") || !on.matches(".on")) return;
    else location.assign(`${location.pathname.replace(/\/rows$/, "/cases")}/${on.dataset.case}`);
    event.preventDefault();
  });

  // A drag along an axis writes its ends into the form, to three digits of its width; open at the ends of the axis.
  const EDGE = 0.015;
  let drag = null;
  const value = ({ low, high, log }, share) => log === undefined ? Number(low) + (high - low) * share : Number(low) * (high / low) ** share;
  const fill = (axis, shares) => {
    const form = document.querySelector("#condition"), ends = shares.map((share) => value(axis, share));
    const digit = 10 ** (Math.floor(Math.log10(Math.abs(ends[1] - ends[0]) || 1)) - 2);
    const text = (at) => shares[at] < EDGE || shares[at] > 1 - EDGE ? "" : String(Number((Math.round(ends[at] / digit) * digit).toPrecision(12)));
    form.elements.of.value = axis.name;
    const order = ends[0] <= ends[1] ? ["least", "most"] : ["most", "least"]; // an axis may run the other way
    order.forEach((end, at) => { form.elements[end].value = text(at); });
    form.requestSubmit();
  };
  const share = ({ top, height }, y) => Math.min(Math.max(1 - (y - top) / height, 0), 1);
  document.addEventListener("pointerdown", (event) => {
    const grip = event.button === 0 && event.target.closest?.("#rows .grip");
    if (!grip) return;
    const { top, height } = grip.getBoundingClientRect();
    drag = { from: event.clientY, top, height, data: grip.parentNode.dataset, rect: grip.parentNode.querySelector(".range") };
  });
  document.addEventListener("pointermove", (event) => {
    if (!drag) return;
    const [low, high] = [drag.from, event.clientY].map((y) => share(drag, y)).sort((a, b) => a - b);
    drag.rect.setAttribute("y", Number(drag.data.top) + (1 - high) * drag.data.height);
    drag.rect.setAttribute("height", (high - low) * drag.data.height);
  });
  document.addEventListener("pointerup", (event) => {
    const done = drag;
    drag = null;
    if (!done || Math.abs(event.clientY - done.from) < LEAST) return;
    fill(done.data, [done.from, event.clientY].map((y) => share(done, y)).sort((a, b) => a - b));
  });
  document.addEventListener("pointercancel", () => { drag = null; });

  // The line and the row of the same case.
  document.addEventListener("pointerover", (event) => {
    const own = event.target.closest?.("#rows [data-case]")?.dataset.case;
    for (const line of document.querySelectorAll("#rows .hover")) line.classList.remove("hover");
    if (own !== undefined) for (const line of document.querySelectorAll(`#rows svg [data-case="${CSS.escape(own)}"]`)) line.classList.add("hover");
  });
  stops();
})();
