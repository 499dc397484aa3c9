// Figures, which the server draws: those that come after their page, values at the pointer and by arrow keys.
"use strict";

// What a panel shows, from its element: its points with their cases, its curves, and how numbers at its pixels are written.
const REACH = 30; // px from the pointer to a point
const panels = new WeakMap();
const numbersIn = (text) => (text ?? "").split(" ").filter(Boolean).map(Number);
const starts = (path) => [...path.matchAll(/[ML](-?[\d.]+) (-?[\d.]+)/g)].map(([, x, y]) => [Number(x), Number(y)]);

sprag.panel = (element) => {
  if (panels.has(element)) return panels.get(element);
  const ends = { x: numbersIn(element.dataset.x), y: numbersIn(element.dataset.y) }, log = (element.dataset.log ?? "").split(" ");
  const [x, y] = (element.dataset.units ?? "|").split("|"), units = { x, y };
  const value = (axis, at) => {
    const [low, high, first, last] = ends[axis], share = (at - first) / (last - first);
    return log.includes(axis) ? low * (high / low) ** share : low + (high - low) * share;
  };
  const written = (axis, at) => {
    const [low, high] = ends[axis], digits = Math.min(Math.max(3 - Math.ceil(Math.log10(Math.abs(high - low) || 1)), 0), 12);
    return `${sprag.decimal(String(Number(value(axis, at).toFixed(digits))))} ${units[axis]}`.trim();
  };
  const points = [...element.querySelectorAll("a[data-case]")].map((link) => {
    const shape = link.querySelector("path, rect"), title = link.querySelector("title");
    // The browser would show the title beside the value.
    if (title) { link.setAttribute("aria-label", title.textContent); title.remove(); }
    const at = shape.matches("rect") ? [shape.x.baseVal.value + shape.width.baseVal.value / 2, shape.y.baseVal.value + shape.height.baseVal.value / 2] : starts(shape.getAttribute("d"))[0];
    return { at, number: link.dataset.case, text: link.getAttribute("aria-label"), href: link.getAttribute("href"), half: shape.matches("rect") ? shape.width.baseVal.value / 2 : 0 };
  });
  for (const path of element.querySelectorAll("path[data-cases]")) {
    const cases = path.dataset.cases.split(" ");
    starts(path.getAttribute("d")).forEach((at, index) => points.push({
      at, number: cases[index], href: `${path.closest("svg").dataset.root}${cases[index]}`,
      text: [written("x", at[0]), written("y", at[1]), path.dataset.line, sprag.say("case {n}", { n: cases[index] })].filter(Boolean).join(", "),
    }));
  }
  const curves = [...element.querySelectorAll("path[data-line]:not([data-cases])")].map((path) => ({ name: path.dataset.line, at: starts(path.getAttribute("d")) }));
  const found = { points, curves, written };
  panels.set(element, found);
  return found;
};

sprag.show = (element, content) => {
  element.innerHTML = content;
  element.dataset.drawn = String(Number(element.dataset.drawn || 0) + 1);
  element.dispatchEvent(new Event("sprag:drawn", { bubbles: true }));
};

sprag.draw = async (element) => {
  try {
    const answer = await sprag.busy(element, sprag.fetch(element.dataset.figure, { headers: { Accept: "text/html, application/json" } }));
    if (!answer.ok) throw new Error((await answer.json().catch(() => ({}))).detail || sprag.refusal(answer));
    sprag.show(element, await answer.text());
    element.classList.remove("stale");
  } catch (error) {
    if (error instanceof sprag.LostError) { element.classList.add("stale"); return; } // out of date until the connection is restored
    sprag.note(element, error.message, () => sprag.draw(element));
  }
};

// Figures that came with their page are there already.
sprag.drawAll = (root) => Promise.all([...root.querySelectorAll("[data-figure]")].map((element) => {
  if (!element.querySelector(".drawn, p.soft")) return sprag.draw(element);
  element.dataset.drawn ||= "1";
  return element.dispatchEvent(new Event("sprag:drawn", { bubbles: true }));
}));

(() => {
  // The value that stands beside the pointer, or at the point that arrow keys have reached.
  const tip = document.createElement("output");
  tip.className = "tip";
  let reached = null;
  const area = (panel) => panel.querySelector(".area").getBoundingClientRect();
  const tell = (panel, at, text) => {
    const figure = panel.closest("svg.figure"), frame = figure.closest(".drawn") ?? figure.parentElement, box = area(panel), outer = frame.getBoundingClientRect();
    const scale = box.width / Number(panel.querySelector(".area").getAttribute("width"));
    if (tip.parentNode !== frame) { frame.classList.add("told"); frame.append(tip); }
    tip.textContent = text;
    tip.hidden = false;
    const left = box.left - outer.left + at[0] * scale, top = box.top - outer.top + at[1] * scale;
    tip.style.left = `${Math.min(Math.max(left - tip.offsetWidth / 2, 0), Math.max(outer.width - tip.offsetWidth, 0))}px`;
    tip.style.top = `${top - tip.offsetHeight - 10 < 0 ? top + 14 : top - tip.offsetHeight - 10}px`;
  };
  const hide = () => { tip.hidden = true; reached = null; };
  const place = (panel, event) => {
    const box = area(panel), width = Number(panel.querySelector(".area").getAttribute("width")) / box.width;
    return [(event.clientX - box.left) * width, (event.clientY - box.top) * width];
  };
  const nearest = (points, [x, y], across) => points.reduce((best, point) => {
    const far = across ? Math.abs(point.at[0] - x) : Math.hypot(point.at[0] - x, point.at[1] - y) - (point.half ?? 0);
    return far < best.far ? { far, point } : best;
  }, { far: Infinity, point: null });
  // Of a motion every curve at one place.
  const along = (panel, at) => {
    const { curves, written } = sprag.panel(panel);
    const found = curves.map((curve) => [curve.name, nearest(curve.at.map((point) => ({ at: point })), at, true).point]).filter(([, point]) => point);
    return found.length ? [written("x", found[0][1].at[0]), ...found.map(([name, point]) => `${name}: ${written("y", point.at[1])}`)].join("\n") : "";
  };

  document.addEventListener("pointermove", (event) => {
    const panel = event.target.closest?.("svg.figure .panel");
    if (!panel) { if (!tip.hidden && !tip.contains(event.target)) hide(); return; }
    const at = place(panel, event), { points } = sprag.panel(panel), { far, point } = nearest(points, at);
    if (point) { if (far <= REACH) tell(panel, point.at, point.text); else hide(); return; }
    const text = along(panel, at);
    if (text) tell(panel, [at[0], Math.max(at[1], 0)], text); else hide();
  });
  document.addEventListener("click", (event) => {
    const panel = event.target.closest?.("svg.figure .panel");
    if (!panel || event.target.closest("a")) return;
    const { far, point } = nearest(sprag.panel(panel).points, place(panel, event));
    if (point && far <= 12) location.assign(point.href);
  });

  // With arrow keys from point to point, and with Enter to its case.
  const reachable = (part) => {
    for (const figure of part.querySelectorAll("svg.figure")) if (figure.querySelector(".panel :is(a, [data-cases], [data-line])")) figure.tabIndex = 0;
  };
  document.addEventListener("sprag:drawn", (event) => reachable(event.target));
  document.addEventListener("DOMContentLoaded", () => reachable(document));
  document.addEventListener("keydown", (event) => {
    const figure = event.target.closest?.("svg.figure");
    if (!figure || event.ctrlKey || event.altKey || event.metaKey) return;
    const step = { ArrowRight: 1, ArrowLeft: -1 }[event.key], turn = { ArrowDown: 1, ArrowUp: -1 }[event.key];
    if (event.key === "Escape") { hide(); return; }
    if (event.key === "Enter" && reached?.point?.href) { location.assign(reached.point.href); return; }
    if (!step && !turn) return;
    event.preventDefault();
    const every = [...figure.querySelectorAll(".panel")], panel = every[(every.indexOf(reached?.panel) + (turn ?? 0) + (reached ? every.length : 1)) % every.length] ?? every[0];
    const { points, curves } = sprag.panel(panel);
    const own = (points.length ? [...points] : (curves[0]?.at ?? []).map((at) => ({ at }))).sort((a, b) => a.at[0] - b.at[0] || b.at[1] - a.at[1]);
    if (!own.length) return;
    const index = Math.min(Math.max((reached?.index ?? -1) + (step ?? 0), 0), own.length - 1);
    reached = { panel, index, point: own[index] };
    tell(panel, own[index].at, own[index].text ?? along(panel, own[index].at));
  });
  document.addEventListener("focusout", (event) => { if (event.target.closest?.("svg.figure")) hide(); });
})();

document.addEventListener("DOMContentLoaded", () => sprag.drawAll(document));
document.addEventListener("sprag:found", () => { for (const plot of document.querySelectorAll(".stale[data-figure]")) sprag.draw(plot); });
