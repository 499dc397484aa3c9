// The laboratory: the server answers a moved slider or a changed field with picture and numbers; the sketch turns here.
"use strict";

const lab = document.getElementById("lab"), plot = document.getElementById("lab-plot"), answer = document.getElementById("answer");
const sketch = document.getElementById("sketch"), angle = document.getElementById("angle");
const dial = document.querySelector("[data-angle]"), turn = document.querySelector("[data-turn]");
const own = lab.getAttribute("action");
let busy = false, again = false, old = false;

// Numbers that are always in sight, and those that were changed.
const query = () => {
  const found = new FormData(lab);
  for (const field of lab.querySelectorAll("[data-further]")) if (field.value === field.dataset.own) found.delete(field.name);
  return new URLSearchParams(found);
};

// One request at a time; later changes are sent when the answer has arrived.
const ask = async () => {
  if (busy) { again = true; return; }
  busy = true;
  try {
    const asked = query();
    const found = await sprag.fetchJson(`${own}/figure?columns=2&${asked}`);
    history.replaceState(null, "", `${own}?${asked}`);
    for (const place of document.querySelectorAll(".lab .wrong")) {
      const texts = found.faults[place.id.slice("wrong:".length)] || [];
      place.textContent = texts.join("; ");
    }
    answer.innerHTML = found.answer;
    document.getElementById("details").innerHTML = found.details;
    plot.classList.toggle("stale", !found.figure);
    sketch.classList.toggle("stale", !found.figure);
    if (found.figure) {
      sketch.innerHTML = found.sketch;
      pose();
      sprag.show(plot, found.figure);
      point();
    }
  } catch (error) {
    plot.classList.add("stale");
    old = true;
    answer.textContent = error.message;
  } finally {
    busy = false;
    if (again) { again = false; ask(); }
  }
};

sprag.slider.wire(lab, ask);

// The sketch: frames a few degrees apart, and straight lines between them.
const degrees = () => Number.parseFloat(angle?.value) || 0;

const between = (frames) => {
  const steps = frames.length - 1, place = ((degrees() % 360 + 360) % 360) / 360 * steps;
  const first = Math.min(Math.floor(place), steps - 1), share = place - first;
  const [a, b] = [frames[first], frames[first + 1]];
  return Array.isArray(a) ? a.map((value, index) => value + (b[index] - value) * share) : a + (b - a) * share;
};

const pose = () => {
  for (const figure of sketch.querySelectorAll("[data-frames]")) {
    figure.frames ||= JSON.parse(figure.dataset.frames);
    const { joints, turns } = figure.frames;
    const at = Object.fromEntries(Object.entries(joints).map(([name, frames]) => [name, between(frames)]));
    for (const bar of figure.querySelectorAll("[data-bar]")) {
      bar.setAttribute("points", bar.dataset.bar.split(" ").map((name) => at[name].join(",")).join(" "));
    }
    for (const plate of figure.querySelectorAll("[data-plate]")) {
      const [name, turned] = plate.dataset.plate.split(" ");
      plate.setAttribute("transform", `translate(${at[name].join(" ")}) rotate(${between(turns[turned])})`);
    }
    for (const joint of figure.querySelectorAll("[data-joint]")) {
      const [x, y] = at[joint.dataset.joint];
      joint.setAttribute("cx", x);
      joint.setAttribute("cy", y);
    }
  }
};

// A line across all panels of the picture, at the angle of the sketch.
const point = () => { if (dial) sprag.mark(plot, Number(dial.value)); };

let pointing = false;
const turned = () => {
  pose();
  if (pointing) return;
  pointing = true;
  requestAnimationFrame(() => { pointing = false; point(); });
};

dial?.addEventListener("input", () => {
  angle.value = dial.value;
  dial.setAttribute("aria-valuetext", sprag.say("{angle} degrees", { angle: sprag.decimal(dial.value) }));
  turned();
});
angle?.addEventListener("input", () => {
  const cycle = Number(dial.max);
  dial.value = (degrees() % cycle + cycle) % cycle;
  turned();
});
dial?.addEventListener("change", () => history.replaceState(null, "", `${own}?${query()}`));

// A turn of the shaft takes four seconds, until it is stopped.
const SECONDS = 4;
turn?.addEventListener("click", () => {
  const on = turn.getAttribute("aria-pressed") !== "true", from = Number(dial.value), begin = performance.now();
  turn.setAttribute("aria-pressed", String(on));
  turn.textContent = on ? sprag.say("Stop") : sprag.say("Turn");
  const run = (now) => {
    if (turn.getAttribute("aria-pressed") !== "true") { history.replaceState(null, "", `${own}?${query()}`); return; }
    dial.value = (from + 0.36 / SECONDS * Math.max(now - begin, 0)) % Number(dial.max);
    angle.value = dial.value;
    turned();
    requestAnimationFrame(run);
  };
  if (on) requestAnimationFrame(run);
});

// A chosen machine is shown immediately, so that picture and name always match.
const machines = document.getElementById("machines");
machines.addEventListener("change", () => machines.submit());
window.addEventListener("pageshow", (event) => { if (event.persisted) machines.reset(); });
document.querySelector("[data-print]").addEventListener("click", () => window.print());
document.addEventListener("DOMContentLoaded", ask);
document.addEventListener("sprag:found", () => { if (old) { old = false; ask(); } });
