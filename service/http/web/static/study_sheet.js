// The working point of a sheet: while it is moved, the line follows and the sentence tells the case, or both neighbours;
// links to drawers open them.
"use strict";

(() => {
  const NEAR = 0.015; // part of the range from which on the point moves to a case
  const range = () => document.querySelector("input[data-cases]");

  // The line across the panels of both charts, at a value of their axis.
  const line = (value) => {
    for (const at of document.querySelectorAll("#chart .panel .at")) {
      const [low, high, start, end] = at.closest(".panel").dataset.x.split(" ").map(Number);
      at.setAttribute("d", at.getAttribute("d").replace(/^M[\d.-]+/, `M${(start + (value - low) / (high - low) * (end - start)).toFixed(1)}`));
    }
  };
  const printed = (value) => `${sprag.decimal(String(+value.toPrecision(4)))} ${range().dataset.unit}`.trim();

  document.addEventListener("input", (event) => {
    const field = event.target.closest?.("input[data-cases]");
    if (!field) return;
    const cases = JSON.parse(field.dataset.cases), wide = field.max - field.min;
    const nearest = cases.reduce((best, one) => (!best || Math.abs(one[0] - field.value) < Math.abs(best[0] - field.value) ? one : best), null);
    const hit = nearest && Math.abs(nearest[0] - field.value) <= NEAR * wide;
    if (hit) field.value = nearest[0];
    const value = Number(field.value);
    line(value);
    if (!cases.length) return;
    const below = cases.filter((one) => one[0] < value).pop(), above = cases.find((one) => one[0] > value);
    const told = hit ? [nearest[1]] : [field.dataset.missing.replace("#", printed(value)), below?.[1], above?.[1]];
    document.getElementById("say").textContent = told.filter(Boolean).join(" ");
    field.setAttribute("aria-valuetext", printed(value));
  });

  // A link to a drawer opens it, and closes the menu that it stands in; so does an address that has it.
  const open = (id) => {
    const part = document.getElementById(id);
    if (part?.matches("details")) part.open = true;
  };
  document.addEventListener("click", (event) => {
    const link = event.target.closest?.('a[href^="#"]');
    if (!link) return;
    open(link.hash.slice(1));
    link.closest("details.menu")?.removeAttribute("open");
  });
  open(location.hash.slice(1));
})();
