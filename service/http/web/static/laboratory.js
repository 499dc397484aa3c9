// The laboratory: a moved slider or a changed field is answered by the server with picture and numbers.
"use strict";

const lab = document.getElementById("lab"), plot = document.getElementById("lab-plot"), answer = document.getElementById("answer");
let busy = false, again = false, old = false;

const valueOf = (slider) => {
  const low = Number(slider.dataset.low), high = Number(slider.dataset.high), share = slider.value / 1000;
  const value = "log" in slider.dataset ? low * (high / low) ** share : low + (high - low) * share;
  return String(Number(value.toPrecision(4)));
};

const positionOf = (slider, value) => {
  const low = Number(slider.dataset.low), high = Number(slider.dataset.high);
  const share = "log" in slider.dataset ? Math.log(value / low) / Math.log(high / low) : (value - low) / (high - low);
  return Math.min(Math.max(1000 * share, 0), 1000);
};

// One question at a time; what changed meanwhile is asked when the answer is there.
const ask = async () => {
  if (busy) { again = true; return; }
  busy = true;
  try {
    const query = new URLSearchParams(new FormData(lab));
    const found = await sprag.fetchJson(`/laboratory/figure?${query}`);
    history.replaceState(null, "", `/laboratory?${query}`);
    for (const place of lab.querySelectorAll(".wrong")) {
      const texts = found.faults[place.id.slice("wrong:".length)] || [];
      place.textContent = texts.join("; ");
    }
    answer.innerHTML = found.answer;
    plot.classList.toggle("stale", !found.figure);
    if (found.figure) await sprag.show(plot, found.figure);
  } catch (error) {
    plot.classList.add("stale");
    old = true;
    answer.textContent = error.message;
  } finally {
    busy = false;
    if (again) { again = false; ask(); }
  }
};

for (const slider of lab.querySelectorAll("input[type=range]")) {
  const field = document.getElementById(slider.dataset.for);
  slider.addEventListener("input", () => {
    field.value = valueOf(slider);
    slider.setAttribute("aria-valuetext", field.value);
    ask();
  });
  field.addEventListener("input", () => {
    const value = Number(field.value);
    if (field.value.trim() !== "" && Number.isFinite(value)) slider.value = positionOf(slider, value);
    ask();
  });
}
for (const field of lab.querySelectorAll("[data-further]")) field.addEventListener("input", ask);
// Another machine is shown as soon as it is chosen: never one beside the name of another.
const machines = document.getElementById("machines");
machines.addEventListener("change", () => machines.submit());
window.addEventListener("pageshow", (event) => { if (event.persisted) machines.reset(); });
document.querySelector("[data-print]").addEventListener("click", () => window.print());
document.addEventListener("DOMContentLoaded", ask);
document.addEventListener("sprag:found", () => { if (old) { old = false; ask(); } });
