// The laboratory: the server answers a moved slider or a changed field with picture and numbers.
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

// One request at a time; later changes are sent when the answer has arrived.
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
// A chosen machine is shown immediately, so that picture and name always match.
const machines = document.getElementById("machines");
machines.addEventListener("change", () => machines.submit());
window.addEventListener("pageshow", (event) => { if (event.persisted) machines.reset(); });
document.querySelector("[data-print]").addEventListener("click", () => window.print());
document.addEventListener("DOMContentLoaded", ask);
document.addEventListener("sprag:found", () => { if (old) { old = false; ask(); } });
