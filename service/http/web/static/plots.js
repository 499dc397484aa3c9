// Draws every element with data-figure: the server makes the figure, this script applies the colours of the page.
"use strict";

// plotly gives some shapes a style attribute, which the policy of the pages refuses; the same as properties is allowed.
const setAttribute = Element.prototype.setAttribute;
SVGElement.prototype.setAttribute = function (name, value) {
  if (name === "style") this.style.cssText = value;
  else setAttribute.call(this, name, value);
};

sprag.figures = new Map();

sprag.colour = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();

// Widths of a picture (px) below which its panels stand one under the other, and its legend under them, as on paper.
const NARROW = 600, BESIDE = 700, LINE = 20, SCALE = 80, LETTER = 7, SYMBOL = 60;
// Size of the titles of axes and the width of their letters (px).
const TITLE = 14, TITLE_LETTER = 8;

// A text in lines that fit a width (px), as far as its words allow.
const linesOf = (text, width, letter = LETTER) => text.split(/ |<br>/).reduce((lines, word) => {
  const longer = [lines.at(-1), word].filter(Boolean).join(" ");
  return longer.length * letter > width ? [...lines, word] : [...lines.slice(0, -1), longer];
}, [""]).filter(Boolean);

const titleLines = (figure, name, width) => linesOf(figure.layout[name]?.title?.text ?? "", width);

const hasScale = (figure) => figure.data.some((trace) => trace.colorbar && trace.showscale !== false);

// Pixels that a legend takes over the whole width.
const legendHeight = (figure, name, width) => {
  const shown = figure.data.filter((trace) => trace.showlegend !== false && (trace.legend || "legend") === name);
  // As plotly sets them: one after the other, in a new row where there is no more room; those of several lines stand alone.
  let rows = 0, left = 0;
  for (const trace of shown) {
    const lines = linesOf(trace.name ?? "", width - SYMBOL), own = SYMBOL + Math.max(...lines.map((line) => line.length), 0) * LETTER;
    if (own > left) { rows += lines.length; left = width; }
    left = lines.length > 1 ? 0 : left - own;
  }
  return shown.length && (rows + Math.max(titleLines(figure, name, width).length, 1)) * LINE;
};

// Room for the legends below the panels. In a narrow picture all are there: beside the panels they would leave no room for them.
// `limited` gives the height that the whole may have.
sprag.fitted = (figure, width, limited) => {
  const { title: heading } = figure.layout, wrapped = heading && { ...heading, text: linesOf(heading.text, width).join("<br>"), xref: "container" };
  const layout = heading && width < BESIDE ? { ...figure.layout, title: wrapped } : figure.layout;
  if (!layout.showlegend && !hasScale(figure)) return { ...layout, height: limited(layout.height) };
  const narrow = width < BESIDE, second = legendHeight(figure, "legend2", width), first = narrow ? legendHeight(figure, "legend", width) : 0;
  const { t, b } = layout.margin, scale = narrow && hasScale(figure) ? SCALE : 0;
  const bottom = b + scale + (first + second ? first + second + 10 : 0);
  const margin = { ...layout.margin, b: bottom, ...(narrow ? { t: layout.title ? 60 : 20, l: 60 } : {}) };
  const height = limited(layout.height - t - b + margin.t + bottom);
  if (!narrow) return { ...layout, height, margin };
  const below = { orientation: "h", x: 0, xref: "container", xanchor: "left", yref: "container", yanchor: "bottom" };
  const title = { ...layout.legend?.title, text: titleLines(figure, "legend", width).join("<br>"), font: { size: 11 } };
  const legends = { legend: { ...layout.legend, ...below, title, y: second / height }, legend2: { ...layout.legend2, ...below, y: 0 } };
  return { ...layout, height, margin, ...legends };
};

// The scale of a map stands below a narrow one, above its legend; long names of entries have several lines there.
sprag.traces = (figure, width, layout) => width >= BESIDE ? figure.data : figure.data.map((trace) => {
  if (!trace.colorbar) return trace.name ? { ...trace, name: linesOf(trace.name, width - SYMBOL).join("<br>") } : trace;
  const y = legendHeight(figure, "legend2", width) / layout.height, title = { ...trace.colorbar.title, side: "bottom" };
  return { ...trace, colorbar: { ...trace.colorbar, title, orientation: "h", x: 0.5, y, yref: "container", yanchor: "bottom" } };
});

// The title of an axis in lines that fit its panel, so that it does not run into those of neighbours.
const fittedTitle = (key, axis, layout, width) => {
  const { l, r, t, b } = layout.margin, whole = key[0] === "y" ? layout.height - t - b : width - l - r, [low, high] = axis.domain ?? [0, 1];
  return { ...axis.title, font: { size: TITLE }, text: linesOf(axis.title.text, (high - low) * whole, TITLE_LETTER).join("<br>") };
};

sprag.themed = (figure, width, limited = (height) => height) => {
  const layout = sprag.fitted(figure, width, limited);
  const ink = sprag.colour("--ink"), line = sprag.colour("--line");
  const themed = {
    ...layout, paper_bgcolor: "rgba(0,0,0,0)", plot_bgcolor: "rgba(0,0,0,0)",
    font: { family: getComputedStyle(document.body).fontFamily, size: 13, color: ink }, dragmode: layout.dragmode || "zoom",
    hoverlabel: { bgcolor: sprag.colour("--tint"), bordercolor: line, font: { color: ink } },
    legend: { bgcolor: "rgba(0,0,0,0)", ...layout.legend }, legend2: { bgcolor: "rgba(0,0,0,0)", ...layout.legend2 },
  };
  for (const [key, axis] of Object.entries(layout)) {
    if (/^[xy]axis\d*$/.test(key)) {
      const title = axis.title?.text ? { title: fittedTitle(key, axis, layout, width) } : {};
      themed[key] = { gridcolor: line, linecolor: sprag.colour("--strong"), ticks: "outside", tickcolor: line, automargin: true, ...axis, ...title };
    }
  }
  return themed;
};

sprag.config = {
  locale: "page", locales: { page: { dictionary: sprag.texts } }, // what its buttons say
  responsive: true, displaylogo: false, showLink: false, showSendToCloud: false, plotlyServerURL: "",
  modeBarButtonsToRemove: ["toImage", "select2d", "lasso2d", "sendChartToCloud"],
};

sprag.show = async (element, figure) => {
  if (figure.note) {
    if (sprag.figures.delete(element)) Plotly.purge(element);
    sprag.note(element, figure.note);
    element.firstChild.className = "soft";
    element.dataset.drawn = String(Number(element.dataset.drawn || 0) + 1);
    return;
  }
  const below = element.nextElementSibling;
  if (below?.matches(".below")) {
    below.textContent = figure.below ?? "";
    below.hidden = !figure.below;
  }
  const first = !sprag.figures.has(element);
  if (first) {
    element.replaceChildren();
    element.setAttribute("role", "group"); // no longer an image: it has buttons
  }
  sprag.figures.set(element, figure);
  const width = element.clientWidth, layout = sprag.themed(figure, width);
  await Plotly.react(element, sprag.traces(figure, width, layout), layout, sprag.config);
  element.dataset.drawn = String(Number(element.dataset.drawn || 0) + 1);
  if (first) element.dispatchEvent(new Event("sprag:drawn", { bubbles: true }));
  if (first && figure.cases && element.dataset.study) {
    element.on("plotly_click", (event) => {
      const number = event.points[0].customdata;
      if (Number.isInteger(number)) location.assign(`${sprag.prefix}/studies/${element.dataset.study}/cases/${number}`);
    });
  }
};

// The address of a figure, whose panels stand one below the other in a narrow place.
sprag.narrowed = (element, address) => element.clientWidth < NARROW ? address.replace("columns=2", "columns=1") : address;

sprag.draw = async (element) => {
  try {
    await sprag.show(element, await sprag.busy(element, sprag.fetchJson(sprag.narrowed(element, element.dataset.figure))));
    element.classList.remove("stale");
  } catch (error) {
    if (error instanceof sprag.LostError) { // the picture is out of date until the connection is restored
      element.classList.add("stale");
      return;
    }
    sprag.figures.delete(element);
    sprag.note(element, error.message, () => sprag.draw(element));
  }
};

sprag.drawAll = (root) => Promise.all([...root.querySelectorAll("[data-figure]")].map(sprag.draw));

// Paper is narrower than the window, and white; on its first page a picture is at most a quarter lower, to fit.
const PAPER = 680, LOW = 580, LOWER = 0.75;
const onPaper = (height) => Math.max(LOWER * height, Math.min(height, LOW));
const redraw = (width) => {
  for (const [element, figure] of sprag.figures) {
    const shown = width || element.clientWidth, layout = sprag.themed(figure, shown, width ? onPaper : undefined);
    Plotly.react(element, sprag.traces(figure, shown, layout), width ? { ...layout, width } : layout, sprag.config);
  }
};
window.addEventListener("beforeprint", () => redraw(PAPER));
window.addEventListener("afterprint", () => redraw());
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => redraw());
for (const width of [NARROW, BESIDE]) matchMedia(`(max-width: ${width}px)`).addEventListener("change", () => redraw());

// Back to a page shows it as it was left: scrolled as far, with figures zoomed as they were, which are drawn later than a browser scrolls.
const PLACE = `sprag.place:${location.pathname}`;
const zoomed = (plot) => Object.fromEntries(Object.entries(plot.layout ?? {})
  .filter(([key, axis]) => /^[xy]axis\d*$/.test(key) && axis.autorange === false).map(([key, axis]) => [`${key}.range`, [...axis.range]]));
const figures = () => [...document.querySelectorAll(".plot[data-figure]")];
window.addEventListener("pagehide", () => {
  sessionStorage.setItem(PLACE, JSON.stringify({ search: location.search, top: scrollY, views: figures().map(zoomed) }));
});
const returned = async () => {
  const place = JSON.parse(sessionStorage.getItem(PLACE));
  if (performance.getEntriesByType("navigation")[0]?.type !== "back_forward" || place?.search !== location.search) return;
  await Promise.all(figures().map((plot, at) => plot.layout && Plotly.relayout(plot, place.views[at] ?? {})));
  scrollTo({ top: place.top, behavior: "instant" });
};
document.addEventListener("DOMContentLoaded", async () => { await sprag.drawAll(document); await returned(); });
document.addEventListener("sprag:found", () => { for (const plot of document.querySelectorAll(".stale[data-figure]")) sprag.draw(plot); });
