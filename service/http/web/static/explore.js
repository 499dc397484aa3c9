// Explore: ranges dragged in its plots become ranges of the form, which show the page of the new choice.
"use strict";

(() => {
  const form = document.querySelector("form.explore"), part = form.dataset.swap;
  const LEAST = 4; // a shorter drag (px) is a click

  const dimension = (name) => document.querySelector(`${part} .dimension[data-name="${CSS.escape(name)}"]`)?.dataset;
  const valueOn = (name, share) => Number(dimension(name).low) + (dimension(name).high - dimension(name).low) * share;

  // Ends of a range as people write them, to three digits of its width; open beyond the ends of the axis.
  const written = (name, low, high) => {
    const digit = 10 ** (Math.floor(Math.log10(high - low || 1)) - 2), axis = dimension(name);
    const text = (value) => String(Number((Math.round(value / digit) * digit).toPrecision(12)));
    return [low <= Number(axis?.low) ? "" : text(low), high >= Number(axis?.high) ? "" : text(high)];
  };

  // Write ranges (null: none) of quantities into the form; one event for all of them.
  const choose = (ranges) => {
    let last = null;
    for (const [name, range] of ranges) {
      const ends = range === null ? ["", ""] : written(name, Math.min(...range), Math.max(...range));
      ["min:", "max:"].forEach((end, index) => {
        const field = form.elements.namedItem(end + name);
        if (field) { field.value = ends[index]; last = field; }
      });
    }
    last?.dispatchEvent(new Event("change", { bubbles: true }));
  };

  const place = (rect, values) => { for (const [key, value] of Object.entries(values)) rect.setAttribute(key, value); };

  // A drag along an axis, or over a pair of quantities.
  let drag = null, dragged = false;
  const alongAxis = (grip) => {
    const group = grip.closest(".dimension"), { name, top, height } = group.dataset, rect = group.querySelector(".range");
    const share = (event) => 1 - (event.clientY - grip.getBoundingClientRect().top) / height;
    const y = (value) => Number(top) + height * (1 - Math.min(Math.max(value, 0), 1));
    return {
      show: (from, to) => { const [above, below] = [share(from), share(to)].map(y).sort((a, b) => a - b); place(rect, { y: above, height: below - above }); },
      end: (from, to) => choose([[name, [share(from), share(to)].map((value) => valueOn(name, value))]]),
      click: () => choose([[name, null]]),
    };
  };
  const overPair = (svg) => {
    const { x, y } = svg.dataset, rect = svg.querySelector(".range"), grid = svg.viewBox.baseVal;
    const shares = (event) => {
      const box = svg.getBoundingClientRect(), inside = (value) => Math.min(Math.max(value, 0), 1);
      return [inside((event.clientX - box.left) / box.width), inside(1 - (event.clientY - box.top) / box.height)];
    };
    return {
      show: (from, to) => {
        const [[left, low], [right, high]] = [shares(from), shares(to)];
        place(rect, { x: grid.width * Math.min(left, right), width: grid.width * Math.abs(right - left),
          y: grid.height * (1 - Math.max(low, high)), height: grid.height * Math.abs(high - low) });
      },
      end: (from, to) => choose([x, y].map((name, index) => [name, [from, to].map((event) => valueOn(name, shares(event)[index]))])),
      click: () => {},
    };
  };
  document.addEventListener("pointerdown", (event) => {
    if (event.button !== 0 || !event.target.closest?.(part)) return;
    const grip = event.target.closest(".parallel .grip"), pair = event.target.closest(".pairs svg");
    if (!grip && !pair) return;
    drag = { from: event, ...(grip ? alongAxis(grip) : overPair(pair)) };
    dragged = false;
  });
  document.addEventListener("pointermove", (event) => {
    if (!drag) return;
    dragged ||= Math.hypot(event.clientX - drag.from.clientX, event.clientY - drag.from.clientY) >= LEAST;
    if (dragged) drag.show(drag.from, event);
  });
  document.addEventListener("pointerup", (event) => {
    const { from, end, click } = drag ?? {};
    drag = null;
    if (from) dragged ? end(from, event) : click();
  });
  document.addEventListener("pointercancel", () => { drag = null; });
  // The link of a pair is not followed after a drag.
  document.addEventListener("dragstart", (event) => { if (event.target.closest?.(".pairs")) event.preventDefault(); });
  document.addEventListener("click", (event) => {
    const line = event.target.closest?.(`${part} .parallel [data-case]`);
    if (line) location.assign(`${sprag.prefix}/studies/${document.querySelector(".plot[data-study]").dataset.study}/cases/${line.dataset.case}`);
    if (!event.target.closest?.(".pairs a")) return;
    const after = dragged && event.detail; // a click by the keyboard has no detail
    dragged = false;
    if (!after && (event.ctrlKey || event.metaKey || event.shiftKey)) return; // a tab or window of its own
    event.preventDefault();
    if (after) return;
    const { x, y } = event.target.closest("a").querySelector("svg").dataset;
    form.elements.x.value = x;
    form.elements.y.value = y;
    form.elements.y.dispatchEvent(new Event("change", { bubbles: true }));
  });

  // The line and the row of the same case.
  document.addEventListener("pointerover", (event) => {
    const own = event.target.closest?.(`${part} [data-case]`)?.dataset.case;
    for (const line of document.querySelectorAll(`${part} path.shown`)) line.classList.remove("shown");
    if (own !== undefined) for (const line of document.querySelectorAll(`${part} path[data-case="${own}"]`)) line.classList.add("shown");
  });

  // A box dragged over the points.
  document.addEventListener("sprag:drawn", (event) => {
    const plot = event.target;
    if (!plot.dataset.x || !plot.on) return;
    plot.on("plotly_selected", (selection) => {
      if (selection?.range) choose([[plot.dataset.x, selection.range.x], [plot.dataset.y, selection.range.y]]);
    });
  });
})();
