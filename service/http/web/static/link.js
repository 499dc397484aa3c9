// The connection to the service: requests of pages go through here, and a bar shows when they are not answered.
"use strict";

const sprag = {};

// The path at which a proxy serves the service; addresses that scripts make begin with it.
sprag.prefix = document.documentElement.dataset.prefix;

// A text in the language of the page, with `values` in place of {name}; English stands in the scripts. And a number
// with the decimal mark of the language.
(() => {
  const data = document.getElementById("texts"), texts = data ? JSON.parse(data.textContent) : {};
  sprag.texts = texts;
  sprag.say = (text, values = {}) => (texts[text] ?? text).replace(/\{(\w+)\}/g, (place, name) => values[name] ?? place);
  sprag.decimal = (text) => text.replace(".", texts["."] ?? ".");
})();

sprag.LostError = class extends Error {
  constructor() { super(sprag.say("The service does not answer.")); }
};

(() => {
  const DELAYS = [1, 2, 5, 10]; // seconds between attempts
  let bar = null, timer = null, tries = 0, leaving = false;
  window.addEventListener("pagehide", () => { leaving = true; });
  window.addEventListener("pageshow", () => { leaving = false; });

  const probe = async () => {
    clearTimeout(timer);
    timer = null;
    const answer = await fetch(`${sprag.prefix}/livez`, { cache: "no-store" }).catch(() => null);
    if (answer && answer.ok) found();
    else plan();
  };

  // Several probes may be under way: the first answer ends the wait, and later ones find no bar.
  const plan = () => {
    if (!bar || timer) return;
    const seconds = DELAYS[Math.min(tries, DELAYS.length - 1)];
    tries += 1;
    bar.querySelector("span").textContent = sprag.say("next try in {n} s.", { n: seconds });
    timer = setTimeout(probe, 1000 * seconds);
  };

  // The service answers again: parts that may be out of date are requested again.
  const found = () => {
    if (!bar) return;
    clearTimeout(timer);
    timer = null;
    bar.remove();
    bar = null;
    document.body.classList.remove("lost");
    document.dispatchEvent(new Event("sprag:found"));
  };

  sprag.lost = () => {
    if (bar || leaving) return;
    document.body.classList.add("lost");
    bar = document.createElement("div");
    bar.className = "link-lost";
    bar.setAttribute("role", "alert");
    const text = document.createElement("strong"), rest = document.createElement("span"), button = document.createElement("button");
    text.textContent = sprag.say("The connection to the service is lost; the page may be out of date.");
    button.type = "button";
    button.textContent = sprag.say("Try now");
    button.addEventListener("click", probe);
    bar.append(text, " ", rest, " ", button);
    document.body.prepend(bar);
    plan();
  };

  sprag.fetch = async (address, options) => {
    let answer = null;
    try {
      answer = await fetch(address, options);
    } catch (error) {
      sprag.lost();
      throw new sprag.LostError();
    }
    // A proxy answers for a service that is down; the service itself explains a 503 as JSON.
    const explained = (answer.headers.get("Content-Type") || "").includes("json");
    if ([502, 504].includes(answer.status) || (answer.status === 503 && !explained)) {
      sprag.lost();
      throw new sprag.LostError();
    }
    tries = 0;
    return answer;
  };
})();

// A part whose content is on its way says so when it takes longer.
sprag.busy = async (element, work) => {
  const timer = setTimeout(() => { element.dataset.loading = sprag.say("Loading …"); element.setAttribute("aria-busy", "true"); }, 200);
  try {
    return await work;
  } finally {
    clearTimeout(timer);
    element.removeAttribute("aria-busy");
  }
};

// What could not be shown in a part, and why; `again` tries once more.
sprag.note = (element, text, again = null) => {
  const note = document.createElement("p"), button = document.createElement("button");
  note.className = "failed";
  note.textContent = text;
  element.replaceChildren(note);
  if (!again) return;
  note.setAttribute("role", "alert");
  button.type = "button";
  button.textContent = sprag.say("Try again");
  button.addEventListener("click", () => again());
  note.append(" ", button);
};

// What an answer without an explanation says.
sprag.refusal = (answer) => sprag.say("The service answered with status {status}.", { status: answer.status });

sprag.fetchJson = async (address, options) => {
  const answer = await sprag.fetch(address, { headers: { Accept: "application/json" }, ...options });
  const body = await answer.json().catch(() => ({ detail: sprag.say("The answer does not come from Sprag.") }));
  if (!answer.ok) throw new Error(body.detail || sprag.refusal(answer));
  return body;
};

// The current page from the server; 422 is a page too, with the faults of the choices.
sprag.page = async (address, options) => {
  const answer = await sprag.fetch(address, { headers: { Accept: "text/html" }, ...options });
  if (answer.redirected && new URL(answer.url).pathname === `${sprag.prefix}/login`) {
    location.reload(); // the session has ended: the login leads back here
    throw new Error(sprag.say("Your session has ended."));
  }
  const page = new DOMParser().parseFromString(await answer.text(), "text/html");
  if (!answer.ok && answer.status !== 422) throw new Error(page.querySelector("main p")?.textContent || sprag.refusal(answer));
  return page;
};

// What somebody has ticked, typed or opened in a part goes into the part that takes its place.
sprag.carry = (mine, theirs) => {
  const open = [...mine.querySelectorAll("details:not([id])")].map((part) => part.open);
  theirs.querySelectorAll("details:not([id])").forEach((part, at) => { part.open = open[at] ?? part.open; });
  for (const part of theirs.querySelectorAll("details[id]")) part.open = mine.querySelector(`#${part.id}`)?.open ?? part.open;
  for (const field of mine.querySelectorAll("input:not([type=hidden]), textarea")) {
    const ticked = ["checkbox", "radio"].includes(field.type), place = `[name="${CSS.escape(field.name)}"]`;
    const other = theirs.querySelector(ticked ? `${place}[value="${CSS.escape(field.value)}"]` : place);
    if (!other) continue;
    if (ticked && field.checked !== field.defaultChecked) other.checked = field.checked;
    if (!ticked && field.value !== field.defaultValue) other.value = field.value;
  }
  for (const field of mine.querySelectorAll("select")) {
    const other = theirs.querySelector(`[name="${CSS.escape(field.name)}"]`);
    const changed = [...field.options].some((option) => option.selected !== option.defaultSelected);
    if (changed && [...other?.options ?? []].some((option) => option.value === field.value)) other.value = field.value;
  }
};

// Insert a part of another page into this one and restore focus and scroll; returns the current part. With `keep` a
// part that the server has not changed stays as it is, and what somebody did in a changed one is kept.
sprag.take = (page, selector, { keep = false } = {}) => {
  const mine = document.querySelector(selector), theirs = page.querySelector(selector);
  if (!mine || !theirs) return mine;
  const served = theirs.outerHTML;
  if (keep && mine.served === served) return mine;
  theirs.served = served;
  if (keep) sprag.carry(mine, theirs);
  const active = mine.contains(document.activeElement) ? document.activeElement : null;
  const selection = active?.selectionStart === undefined ? null : [active.selectionStart, active.selectionEnd];
  const stops = "a,button,input,select,textarea,summary,[tabindex]";
  const index = active ? [...mine.querySelectorAll(stops)].indexOf(active) : -1;
  const scrolled = [...mine.querySelectorAll(".scroll")].map((part) => part.scrollLeft);
  mine.replaceWith(document.adoptNode(theirs));
  theirs.dispatchEvent(new Event("sprag:drawn", { bubbles: true })); // its figures are stops before the focus is sought
  theirs.querySelectorAll(".scroll").forEach((part, at) => { part.scrollLeft = scrolled[at] || 0; });
  const again = index >= 0 ? theirs.querySelectorAll(stops)[index] : null;
  again?.focus({ preventScroll: true });
  if (selection?.[0] != null && again?.setSelectionRange) again.setSelectionRange(...selection);
  return theirs;
};

// The draft of a submitted form is not needed any more, nor is any draft by the next user of this browser.
if (location.pathname.startsWith(`${sprag.prefix}/studies/`) || location.pathname === `${sprag.prefix}/nights`) {
  const sent = sessionStorage.getItem("sprag.sent");
  if (sent) localStorage.removeItem(sent);
  sessionStorage.removeItem("sprag.sent");
}
document.querySelector('form[action$="/logout"]')?.addEventListener("submit", () => {
  for (const key of Object.keys(localStorage)) if (key.startsWith("sprag.draft:")) localStorage.removeItem(key);
});
