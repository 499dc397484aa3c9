// The laboratory of vibration drives: the server answers a moved slider with the settled motion, begun from the one before.
"use strict";

const lab = document.getElementById("lab"), plot = document.getElementById("lab-plot"), answer = document.getElementById("answer");
const details = document.getElementById("details"), state = document.getElementById("state"), held = lab.elements.held;
const hold = document.getElementById("hold"), release = document.getElementById("release");
const place = lab.getAttribute("action");
let busy = false, again = null, lost = false, own = "";

// What is set, without the further numbers that are the machine's own.
const changed = (name) => !("further" in (lab.elements[name]?.dataset ?? {})) || lab.elements[name].value !== lab.elements[name].dataset.own;
const written = () => new URLSearchParams([...new FormData(lab)].filter(([name, text]) => text !== "" && changed(name))).toString();

const take = async (found, query) => {
  history.replaceState(null, "", `${place}?${query}`);
  for (const told of lab.querySelectorAll(".wrong")) {
    const name = told.id.slice("wrong:".length), texts = found.faults[name] || [];
    told.textContent = texts.join("; ");
    lab.elements[name].toggleAttribute("aria-invalid", texts.length > 0);
  }
  answer.innerHTML = found.answer;
  details.innerHTML = found.details;
  state.replaceChildren(...Object.entries(found.state).map(([name, value]) => Object.assign(document.createElement("input"), { type: "hidden", name, value })));
  own = found.own;
  hold.href = `${place}?${own}&${new URLSearchParams({ held: own })}`;
  release.href = `${place}?${own}`;
  release.hidden = !held.value;
  plot.classList.toggle("stale", !found.figure);
  if (found.figure) sprag.show(plot, found.figure);
  sprag.sketch.show(found.frames);
};

// One request at a time; of later changes the last is sent when the answer has arrived, from the state that it brings.
const ask = async (queryOf = written) => {
  if (busy) { again = queryOf; return; }
  busy = true;
  const query = queryOf();
  try {
    await take(await sprag.fetchJson(`${place}/figure?${query}`), query);
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
