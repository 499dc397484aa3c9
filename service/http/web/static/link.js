// The connection to the service: requests of pages go through here, and a bar shows when they are not answered.
"use strict";

const sprag = {};

sprag.LostError = class extends Error {
  constructor() { super("The service does not answer."); }
};

(() => {
  const DELAYS = [1, 2, 5, 10]; // seconds between attempts
  let bar = null, timer = null, tries = 0, leaving = false;
  window.addEventListener("pagehide", () => { leaving = true; });
  window.addEventListener("pageshow", () => { leaving = false; });

  const probe = async () => {
    clearTimeout(timer);
    timer = null;
    const answer = await fetch("/livez", { cache: "no-store" }).catch(() => null);
    if (answer && answer.ok) found();
    else plan();
  };

  // Several probes may be under way: the first answer ends the wait, and later ones find no bar.
  const plan = () => {
    if (!bar || timer) return;
    const seconds = DELAYS[Math.min(tries, DELAYS.length - 1)];
    tries += 1;
    bar.querySelector("span").textContent = `next try in ${seconds} s.`;
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
    text.textContent = "The connection to the service is lost; the page may be out of date.";
    button.type = "button";
    button.textContent = "Try now";
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

sprag.fetchJson = async (address, options) => {
  const answer = await sprag.fetch(address, { headers: { Accept: "application/json" }, ...options });
  const body = await answer.json().catch(() => ({ detail: "The answer does not come from Sprag." }));
  if (!answer.ok) throw new Error(body.detail || `The service answered with status ${answer.status}.`);
  return body;
};

// The current page from the server; 422 is a page too, with the faults of the choices.
sprag.page = async (address, options) => {
  const answer = await sprag.fetch(address, { headers: { Accept: "text/html" }, ...options });
  if (answer.redirected && new URL(answer.url).pathname === "/login") {
    location.reload(); // the session has ended: the login leads back here
    throw new Error("Your session has ended.");
  }
  const page = new DOMParser().parseFromString(await answer.text(), "text/html");
  if (!answer.ok && answer.status !== 422) throw new Error(page.querySelector("main p")?.textContent || `The service answered with status ${answer.status}.`);
  return page;
};

// Insert a part of another page into this one and restore the focus; returns the current part.
sprag.take = (page, selector) => {
  const mine = document.querySelector(selector), theirs = page.querySelector(selector);
  if (!mine || !theirs) return mine;
  const active = mine.contains(document.activeElement) ? document.activeElement : null;
  const stops = "a,button,input,select,[tabindex]";
  const index = active ? [...mine.querySelectorAll(stops)].indexOf(active) : -1;
  const scrolled = [...mine.querySelectorAll(".scroll")].map((part) => part.scrollLeft);
  mine.replaceWith(document.adoptNode(theirs));
  theirs.querySelectorAll(".scroll").forEach((part, at) => { part.scrollLeft = scrolled[at] || 0; });
  if (index >= 0) theirs.querySelectorAll(stops)[index]?.focus({ preventScroll: true });
  return theirs;
};
