// Designs of a search: parallel coordinates, and ranges that select designs in them, in the scatter and in the table.
"use strict";

(async () => {
  const SVG = "http://www.w3.org/2000/svg", HEIGHT = 240, TOP = 34, STEP = 130, EDGE = 60, MARGIN = 14;
  const section = document.querySelector("#parallel"), scatter = document.querySelector("#scatter");
  if (!section) return;
  const found = await sprag.fetchJson(section.dataset.front).catch(() => null);
  if (!found?.designs.length) return;

  const make = (name, attributes, text) => {
    const element = document.createElementNS(SVG, name);
    for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
    if (text !== undefined) element.textContent = text;
    return element;
  };
  const short = (value) => String(Number(value.toPrecision(4)));
  // As in the scatter, designs far outside what the feasible ones reach are left out: they would squeeze all others.
  const reached = found.best.map((goal) => found.designs.filter((design) => design.feasible).map((design) => design.goals[goal.result]));
  const near = (design) => design.feasible || found.best.every((goal, index) => {
    const least = Math.min(...reached[index]), most = Math.max(...reached[index]), own = design.goals[goal.result];
    return reached[index].length < 5 || most === least || (own !== null && own >= 2 * least - most && own <= 2 * most - least);
  });
  const designs = found.designs.filter((design) => !design.failed && near(design));
  // Names as the page writes them: the form above lists every quantity with its unit.
  const titles = new Map([...document.querySelectorAll("select[name=x] option")].map((option) => [option.value, option.textContent]));
  // And numbers in these units: the data are in SI.
  const factors = new Map([...document.querySelectorAll("select[name=x] option")].map((option) => [option.value, Number(option.dataset.factor)]));
  const shown = (name, value) => (value === null ? null : value * (factors.get(name) ?? 1));
  const axes = [
    ...found.variables.map((one) => ({ name: one.name, unit: one.unit, of: (design) => shown(one.name, design.variables[one.name]) })),
    ...found.best.map((goal) => ({ name: goal.result, unit: goal.unit, of: (design) => shown(goal.result, design.goals[goal.result]) })),
  ];
  for (const axis of axes) {
    const values = designs.map(axis.of).filter(Number.isFinite);
    axis.low = Math.min(...values);
    axis.high = Math.max(...values);
    axis.inputs = [];
  }
  const at = (axis, value) => TOP + HEIGHT * (axis.high > axis.low ? (axis.high - value) / (axis.high - axis.low) : 0.5);
  const value = (axis, y) => axis.high - (axis.high - axis.low) * Math.min(Math.max((y - TOP) / HEIGHT, 0), 1);

  // One line for each design; those on the front are drawn last, above the others.
  const width = 2 * EDGE + STEP * (axes.length - 1), drawing = make("svg", { width, height: HEIGHT + TOP + 30, class: "parallel" });
  const lines = new Map();
  const kind = (design) => (!design.feasible ? "outside" : design.rank ? "inside" : "front");
  for (const part of ["outside", "inside", "front"]) {
    for (const design of designs.filter((one) => kind(one) === part)) {
      const points = axes.map((axis, index) => `${EDGE + STEP * index},${at(axis, axis.of(design) ?? axis.low)}`).join(" ");
      const line = make("polyline", { points, class: part });
      line.append(make("title", {}, sprag.say("design {n}", { n: design.design })));
      line.addEventListener("click", () => location.assign(`${sprag.prefix}/studies/${found.study}/cases/${design.cases[0]}`));
      lines.set(design.design, line);
      drawing.append(line);
    }
  }

  let boxed = null; // cases selected in the scatter
  const numbers = (axis) => axis.inputs.map((input) => (input.value.trim() === "" ? NaN : Number(input.value.trim().replace(",", "."))));
  const kept = (design) => axes.every((axis) => {
    const [low, high] = numbers(axis), own = axis.of(design);
    return !(own < low) && !(own > high) && (own !== null || (Number.isNaN(low) && Number.isNaN(high)));
  }) && (!boxed || boxed.has(design.cases[0]));

  const update = () => {
    const chosen = designs.filter(kept), every = chosen.length === designs.length;
    const names = new Set(chosen.map((design) => design.design)), cases = new Set(chosen.map((design) => design.cases[0]));
    for (const [name, line] of lines) line.classList.toggle("out", !names.has(name));
    for (const row of document.querySelectorAll("#designs tr[data-design]")) row.hidden = !every && !names.has(Number(row.dataset.design));
    section.querySelector("output").textContent = sprag.say("{count} of {total} designs shown are selected.", { count: chosen.length, total: designs.length });
    for (const axis of axes) {
      const [low, high] = numbers(axis), top = at(axis, Number.isNaN(high) ? axis.high : Math.min(high, axis.high));
      const bottom = at(axis, Number.isNaN(low) ? axis.low : Math.max(low, axis.low));
      const open = Number.isNaN(low) && Number.isNaN(high);
      axis.bar.setAttribute("y", Math.min(top, bottom));
      axis.bar.setAttribute("height", open ? 0 : Math.max(bottom - top, 0));
    }
    if (scatter && sprag.figures.has(scatter)) {
      const points = scatter.data.map((trace) => (every ? null : (trace.customdata || []).flatMap((number, index) => (cases.has(number) ? [index] : []))));
      Plotly.restyle(scatter, { selectedpoints: points });
    }
  };

  // A range is dragged along an axis, or written into its two fields.
  const ranges = section.querySelector(".ranges");
  axes.forEach((axis, index) => {
    const x = EDGE + STEP * index;
    drawing.append(make("line", { x1: x, x2: x, y1: TOP, y2: TOP + HEIGHT, class: "axis" }));
    const title = titles.get(axis.name) ?? axis.name, words = title.split(" ");
    // Two lines of about the same length.
    const halves = words.map((_, index) => [words.slice(0, index).join(" "), words.slice(index).join(" ")]);
    const [above, below] = halves.reduce((best, pair) => (Math.max(...pair.map((part) => part.length)) < Math.max(...best.map((part) => part.length)) ? pair : best));
    drawing.append(make("text", { x, y: 12 }, above), make("text", { x, y: 26 }, below));
    drawing.append(make("text", { x, y: TOP + HEIGHT + 14 }, sprag.decimal(short(axis.low))), make("text", { x: x + 8, y: TOP + 10, class: "start" }, sprag.decimal(short(axis.high))));
    axis.bar = make("rect", { x: x - 5, width: 10, y: TOP, height: 0, class: "bar" });
    const grip = make("rect", { x: x - MARGIN, width: 2 * MARGIN, y: TOP, height: HEIGHT, class: "grip" });
    let from = null;
    const place = (event) => value(axis, event.clientY - drawing.getBoundingClientRect().top);
    const drag = (event) => {
      const ends = [from, place(event)].sort((a, b) => a - b);
      axis.inputs.forEach((input, end) => { input.value = short(ends[end]); });
      update();
    };
    grip.addEventListener("pointerdown", (event) => { from = place(event); grip.setPointerCapture(event.pointerId); });
    grip.addEventListener("pointermove", (event) => { if (from !== null) drag(event); });
    grip.addEventListener("pointerup", (event) => {
      if (from === place(event)) axis.inputs.forEach((input) => { input.value = ""; });
      from = null;
      update();
    });
    drawing.append(axis.bar, grip);
    const field = document.createElement("fieldset"), legend = document.createElement("legend");
    legend.textContent = title;
    field.append(legend);
    for (const [word, limit] of [[sprag.say("from"), axis.low], [sprag.say("to"), axis.high]]) {
      const label = document.createElement("label"), input = document.createElement("input");
      input.type = "number";
      input.step = "any";
      input.placeholder = sprag.decimal(short(limit));
      input.addEventListener("input", update);
      axis.inputs.push(input);
      label.append(`${word} `, input);
      field.append(label);
    }
    ranges.append(field);
  });

  section.querySelector(".scroll").append(drawing);
  section.querySelector("button").addEventListener("click", () => {
    boxed = null;
    for (const axis of axes) for (const input of axis.inputs) input.value = "";
    update();
  });
  section.hidden = false;
  update();

  // The scatter is drawn by another script, when its figure has come.
  const listen = () => {
    if (!scatter?.on) return false;
    scatter.on("plotly_selected", (event) => {
      boxed = event?.points.length ? new Set(event.points.map((point) => point.customdata)) : null;
      update();
    });
    scatter.on("plotly_deselect", () => { boxed = null; update(); });
    update();
    return true;
  };
  if (scatter && !listen()) {
    const watch = new MutationObserver(() => { if (listen()) watch.disconnect(); });
    watch.observe(scatter, { childList: true, attributes: true });
  }
})();
