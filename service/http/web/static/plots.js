// Draws every element that has data-figure: the server makes the figure, this gives it the colours of the page.
"use strict";

// plotly gives some shapes a style attribute, which the policy of the pages refuses; the same as properties is allowed.
const setAttribute = Element.prototype.setAttribute;
SVGElement.prototype.setAttribute = function (name, value) {
  if (name === "style") this.style.cssText = value;
  else setAttribute.call(this, name, value);
};

sprag.figures = new Map();

sprag.colour = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();

// Widths of a picture (px) below which its panels stand one under the other, and its legend under them.
const NARROW = 600, ENTRY = 110, LINE = 20;

// What a narrow picture has in the place of the server's layout: beside the panels a legend would leave no room for them.
sprag.fitted = (figure, width) => {
  const layout = figure.layout, shown = figure.data.filter((trace) => trace.showlegend !== false).length;
  if (width >= NARROW || !layout.showlegend) return layout;
  const rows = Math.ceil(shown / Math.max(Math.floor(width / ENTRY), 1)) + 1;
  const bottom = 70 + rows * LINE, margin = { ...layout.margin, t: 20, l: 60, b: bottom };
  const height = layout.height - layout.margin.t - layout.margin.b + margin.t + bottom;
  const legend = { ...layout.legend, orientation: "h", x: 0, xanchor: "left", y: 0, yref: "container", yanchor: "bottom" };
  return { ...layout, height, margin, legend };
};

sprag.themed = (figure, width) => {
  const layout = sprag.fitted(figure, width);
  const ink = sprag.colour("--ink"), line = sprag.colour("--line");
  const themed = {
    ...layout, paper_bgcolor: "rgba(0,0,0,0)", plot_bgcolor: "rgba(0,0,0,0)",
    font: { family: getComputedStyle(document.body).fontFamily, size: 13, color: ink }, dragmode: layout.dragmode || "zoom",
    hoverlabel: { bgcolor: sprag.colour("--tint"), bordercolor: line, font: { color: ink } },
    legend: { bgcolor: "rgba(0,0,0,0)", ...layout.legend },
  };
  for (const [key, axis] of Object.entries(layout)) {
    if (/^[xy]axis\d*$/.test(key)) {
      themed[key] = { gridcolor: line, linecolor: sprag.colour("--strong"), ticks: "outside", tickcolor: line, automargin: true, ...axis };
    }
  }
  return themed;
};

sprag.config = {
  responsive: true, displaylogo: false, showLink: false, showSendToCloud: false, plotlyServerURL: "",
  modeBarButtonsToRemove: ["toImage", "select2d", "lasso2d", "sendChartToCloud"],
};

sprag.say = (element, text) => {
  const note = document.createElement("p");
  note.className = "failed";
  note.textContent = text;
  element.replaceChildren(note);
};

sprag.show = async (element, figure) => {
  if (figure.note) {
    if (sprag.figures.delete(element)) Plotly.purge(element);
    sprag.say(element, figure.note);
    element.firstChild.className = "soft";
    element.dataset.drawn = String(Number(element.dataset.drawn || 0) + 1);
    return;
  }
  const first = !sprag.figures.has(element);
  if (first) element.replaceChildren();
  sprag.figures.set(element, figure);
  await Plotly.react(element, figure.data, sprag.themed(figure, element.clientWidth), sprag.config);
  element.dataset.drawn = String(Number(element.dataset.drawn || 0) + 1);
  if (first && figure.cases && element.dataset.study) {
    element.on("plotly_click", (event) => {
      const number = event.points[0].customdata;
      if (Number.isInteger(number)) location.assign(`/studies/${element.dataset.study}/cases/${number}`);
    });
  }
};

sprag.draw = async (element) => {
  try {
    const address = element.clientWidth < NARROW ? element.dataset.figure.replace("columns=2", "columns=1") : element.dataset.figure;
    await sprag.show(element, await sprag.fetchJson(address));
    element.classList.remove("stale");
  } catch (error) {
    if (error instanceof sprag.LostError) { // what is shown is old, until the connection is there again
      element.classList.add("stale");
      return;
    }
    sprag.figures.delete(element);
    sprag.say(element, error.message);
  }
};

sprag.drawAll = (root) => Promise.all([...root.querySelectorAll("[data-figure]")].map(sprag.draw));

// Paper is narrower than the window, and white.
const PAPER = 690;
const redraw = (width) => {
  for (const [element, figure] of sprag.figures) {
    const layout = sprag.themed(figure, width || element.clientWidth);
    Plotly.react(element, figure.data, width ? { ...layout, width } : layout, sprag.config);
  }
};
window.addEventListener("beforeprint", () => redraw(PAPER));
window.addEventListener("afterprint", () => redraw());
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => redraw());
matchMedia(`(max-width: ${NARROW}px)`).addEventListener("change", () => redraw());

document.addEventListener("DOMContentLoaded", () => sprag.drawAll(document));
document.addEventListener("sprag:found", () => { for (const plot of document.querySelectorAll(".stale[data-figure]")) sprag.draw(plot); });
