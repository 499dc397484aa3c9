// The laboratory of vibration drives: the server answers a moved slider with the settled motion, begun from the one before.
"use strict";

const lab = document.getElementById("lab"), plot = document.getElementById("lab-plot"), answer = document.getElementById("answer");
const details = document.getElementById("details"), state = document.getElementById("state"), held = lab.elements.held;
const hold = document.getElementById("hold"), release = document.getElementById("release");
let busy = false, again = null, lost = false, own = "";

const written = () => new URLSearchParams([...new FormData(lab)].filter(([, text]) => text !== "")).toString();

const take = async (found, query) => {
  history.replaceState(null, "", `${sprag.prefix}/laboratory/drive?${query}`);
  for (const place of lab.querySelectorAll(".wrong")) {
    const name = place.id.slice("wrong:".length), texts = found.faults[name] || [];
    place.textContent = texts.join("; ");
    lab.elements[name].toggleAttribute("aria-invalid", texts.length > 0);
  }
  answer.innerHTML = found.answer;
  details.innerHTML = found.details;
  state.replaceChildren(...Object.entries(found.state).map(([name, value]) => Object.assign(document.createElement("input"), { type: "hidden", name, value })));
  own = found.own;
  hold.href = `${sprag.prefix}/laboratory/drive?${own}&${new URLSearchParams({ held: own })}`;
  release.href = `${sprag.prefix}/laboratory/drive?${own}`;
  release.hidden = !held.value;
  plot.classList.toggle("stale", !found.figure);
  if (found.figure) await sprag.show(plot, found.figure);
  sprag.sketch.show(found.frames);
};

// One request at a time; of later changes the last is sent when the answer has arrived, from the state that it brings.
const ask = async (queryOf = written) => {
  if (busy) { again = queryOf; return; }
  busy = true;
  const query = queryOf();
  try {
    await take(await sprag.fetchJson(`${sprag.prefix}/laboratory/drive/figure?${query}`), query);
  } catch (error) {
    plot.classList.add("stale");
    lost = true;
    answer.textContent = error.message;
  } finally {
    busy = false;
    if (again) { const next = again; again = null; ask(next); }
  }
};

sprag.slider.wire(lab, () => ask());
lab.addEventListener("submit", (event) => {
  event.preventDefault();
  if (event.submitter?.id === "rest") state.replaceChildren();
  ask();
});
// The motion shown is its query, without the state to which it has come.
hold.addEventListener("click", (event) => {
  event.preventDefault();
  held.value = own;
  ask(() => `${own}&${new URLSearchParams({ held: own })}`);
});
release.addEventListener("click", (event) => {
  event.preventDefault();
  held.value = "";
  ask(() => own);
});
const machines = document.getElementById("machines");
machines.addEventListener("change", () => machines.submit());
window.addEventListener("pageshow", (event) => { if (event.persisted) machines.reset(); });
document.querySelector("[data-print]").addEventListener("click", () => window.print());
// The address has the state from which the motion shown has started.
document.addEventListener("DOMContentLoaded", () => ask(() => location.search.slice(1)));
document.addEventListener("sprag:found", () => { if (lost) { lost = false; ask(); } });
