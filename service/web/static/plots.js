// Draws every element that has data-figure: the server makes the figure, this gives it the colours of the page.
"use strict";

const sprag = { figures: new Map() };

sprag.colour = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();

sprag.themed = (layout) => {
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
  responsive: true, displaylogo: false, showLink: false, showEditInChartStudio: false, plotlyServerURL: "",
  modeBarButtonsToRemove: ["toImage", "select2d", "lasso2d", "sendDataToCloud"],
};

sprag.say = (element, text) => {
  const note = document.createElement("p");
  note.className = "failed";
  note.textContent = text;
  element.replaceChildren(note);
};

sprag.fetchJson = async (address, options) => {
  const answer = await fetch(address, { headers: { Accept: "application/json" }, ...options });
  const body = await answer.json().catch(() => ({ detail: "The service did not answer." }));
  if (!answer.ok) throw new Error(body.detail || "The service did not answer.");
  return body;
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
  await Plotly.react(element, figure.data, sprag.themed(figure.layout), sprag.config);
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
    await sprag.show(element, await sprag.fetchJson(element.dataset.figure));
  } catch (error) {
    sprag.figures.delete(element);
    sprag.say(element, error.message);
  }
};

sprag.drawAll = (root) => Promise.all([...root.querySelectorAll("[data-figure]")].map(sprag.draw));

// Paper is narrower than the window, and white.
const PAPER = 690;
window.addEventListener("beforeprint", () => {
  for (const [element, figure] of sprag.figures) Plotly.react(element, figure.data, { ...sprag.themed(figure.layout), width: PAPER }, sprag.config);
});
window.addEventListener("afterprint", () => {
  for (const [element, figure] of sprag.figures) Plotly.react(element, figure.data, sprag.themed(figure.layout), sprag.config);
});
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => {
  for (const [element, figure] of sprag.figures) Plotly.react(element, figure.data, sprag.themed(figure.layout), sprag.config);
});

document.addEventListener("DOMContentLoaded", () => sprag.drawAll(document));
