// The working point of a sheet: while it is moved, the line follows and the sentence tells the case, or both neighbours;
// links to drawers open them.
"use strict";

(() => {
  // The point moves to a case from this part of the range on, and of the way to the next case; otherwise to round values.
  const NEAR = 0.005, OF_WAY = 0.25, ROUND = 100, SAME = 1e-9;
  const range = () => document.querySelector("input[data-cases]");

  // The line across the panels of both charts, at a value of their axis.
  const line = (value) => {
    for (const at of document.querySelectorAll("#chart .panel .at")) {
      const [low, high, start, end] = at.closest(".panel").dataset.x.split(" ").map(Number);
      at.setAttribute("d", at.getAttribute("d").replace(/^M[\d.-]+/, `M${(start + (value - low) / (high - low) * (end - start)).toFixed(1)}`));
    }
  };
  const printed = (value) => `${sprag.decimal(String(+value.toPrecision(4)))} ${range().dataset.unit}`.trim();

  // The number and the slider are the same point; a number stays as it is typed.
  const POINT = "input[data-cases], .point [name=point]";
  document.addEventListener("input", (event) => {
    if (!event.target.matches?.(POINT) || !event.target.value) return;
    const field = range(), typed = event.target !== field, at = Number(event.target.value);
    const cases = JSON.parse(field.dataset.cases), wide = field.max - field.min;
    const [nearest, next] = [...cases].sort((one, other) => Math.abs(one[0] - at) - Math.abs(other[0] - at));
    const unit = 10 ** Math.floor(Math.log10(wide / ROUND)), round = typed ? at : Number((Math.round(at / unit) * unit).toPrecision(12));
    const near = typed ? SAME * wide : Math.min(NEAR * wide, next ? OF_WAY * Math.abs(next[0] - nearest[0]) : wide);
    const hit = nearest && (Math.abs(nearest[0] - at) <= near || nearest[0] === round), value = hit ? nearest[0] : round;
    field.value = value;
    if (!typed) document.querySelector(".point [name=point]").value = +value.toPrecision(10);
    line(Number(field.value));
    if (!cases.length) return;
    const below = cases.filter((one) => one[0] < value).pop(), above = cases.find((one) => one[0] > value);
    const told = hit ? [nearest[1]] : [field.dataset.missing.replace("#", printed(value)), below?.[1], above?.[1]];
    document.getElementById("say").textContent = told.filter(Boolean).join(" ");
    field.setAttribute("aria-valuetext", printed(value));
  });

  // Arrows go from case to case.
  const STEPS = { ArrowRight: 1, ArrowUp: 1, ArrowLeft: -1, ArrowDown: -1 };
  document.addEventListener("keydown", (event) => {
    const field = event.target.matches?.(POINT) ? range() : null, step = STEPS[event.key];
    if (!field || !step || event.ctrlKey || event.metaKey || event.altKey || (event.target !== field && /Left|Right/.test(event.key))) return;
    const at = Number(field.value), ahead = JSON.parse(field.dataset.cases).map(([value]) => value).filter((value) => step * (value - at) > 0);
    if (ahead.length || event.target !== field) event.preventDefault();
    if (!ahead.length) return;
    field.value = step > 0 ? Math.min(...ahead) : Math.max(...ahead);
    for (const name of ["input", "change"]) field.dispatchEvent(new Event(name, { bubbles: true }));
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
