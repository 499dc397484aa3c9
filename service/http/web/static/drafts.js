// What is typed into a form is kept in this browser until it is submitted, and offered when the form is opened again.
// Loaded before form.js, which has the form of a new study; forms with data-draft need no script of their own.
"use strict";

sprag.drafts = (() => {
  const PREFIX = "sprag.draft:", SENT = "sprag.sent", DAYS = 30, WAIT = 300;
  const OWN = ["key", "history", "edited", "etag"]; // fields that nobody types into
  let name = `${PREFIX}${location.pathname}${location.search}`, timer = null;

  const fieldsOf = (form) => [...new FormData(form)].filter(([, value]) => typeof value === "string");
  const typed = (fields) => JSON.stringify(fields.filter(([field]) => !OWN.includes(field)));
  const read = (key) => { try { return JSON.parse(localStorage.getItem(key)); } catch { return null; } };
  const forget = () => { clearTimeout(timer); localStorage.removeItem(name); };

  // A full store keeps what it has: nothing is worse than without it.
  const write = (form) => { try { localStorage.setItem(name, JSON.stringify({ at: Date.now(), fields: fieldsOf(form) })); } catch { /* full */ } };
  const keep = (form) => { clearTimeout(timer); timer = setTimeout(() => write(form), WAIT); };

  const clean = () => {
    for (const key of Object.keys(localStorage).filter((one) => one.startsWith(PREFIX))) {
      if (!(Date.now() - read(key)?.at < DAYS * 86400000)) localStorage.removeItem(key);
    }
  };

  // The draft that differs from the form as it is, if there is one. A refused form comes back with its fields filled in.
  const waiting = (form, refused) => {
    clean();
    const sent = sessionStorage.getItem(SENT);
    sessionStorage.removeItem(SENT);
    if (sent && refused) { name = sent; return null; }
    const draft = read(name);
    return draft && typed(draft.fields) !== typed(fieldsOf(form)) ? draft : null;
  };

  // A bar above the form: `take` puts the fields of the draft into it.
  const offer = (form, draft, take) => {
    const bar = document.createElement("p"), text = document.createElement("span"), go = document.createElement("button"), drop = document.createElement("button");
    bar.className = "notice bar screen draft-offer";
    bar.setAttribute("role", "status");
    text.textContent = sprag.say("What you typed here on {when} was not submitted.", { when: new Date(draft.at).toLocaleString(document.documentElement.lang) });
    go.type = drop.type = "button";
    go.textContent = sprag.say("Continue with it");
    drop.textContent = sprag.say("Discard it");
    go.addEventListener("click", async () => { if (await take(draft.fields)) bar.remove(); });
    drop.addEventListener("click", () => { if (read(name)?.at === draft.at) forget(); bar.remove(); });
    bar.append(text, " ", go, " ", drop);
    form.before(bar);
  };

  // The page after a submission removes the draft, unless it is the form again.
  const submitted = (form) => { clearTimeout(timer); write(form); sessionStorage.setItem(SENT, name); };
  return { keep, waiting, offer, submitted };
})();

// A form that has the same fields whatever is typed, or a button with the value of data-draft that makes it again with others.
for (const form of document.querySelectorAll("form[data-draft]")) {
  const fill = (fields) => {
    const left = [...fields];
    for (const field of form.elements) {
      // With the edition on which the draft is based, so that it replaces no later one unseen.
      if (!field.name || (field.type === "hidden" && field.name !== "etag")) continue;
      const ticked = ["checkbox", "radio"].includes(field.type);
      const at = left.findIndex(([name, value]) => name === field.name && (!ticked || value === field.value));
      if (ticked) field.checked = at >= 0;
      else if (at >= 0) field.value = left[at][1];
      if (at >= 0) left.splice(at, 1);
    }
    if (form.dataset.draft && left.some(([name]) => name.startsWith("/") && !form.elements.namedItem(name))) {
      const hidden = ([name, value]) => Object.assign(document.createElement("input"), { type: "hidden", name, value });
      form.replaceChildren(...fields.map(hidden));
      sprag.drafts.submitted(form);
      form.append(hidden(["do", form.dataset.draft]));
      form.submit();
    }
    return true;
  };
  const draft = sprag.drafts.waiting(form, Boolean("again" in form.dataset || document.querySelector("main .fault, main .wrong:not(:empty)")));
  if (draft) sprag.drafts.offer(form, draft, fill);
  form.addEventListener("input", () => sprag.drafts.keep(form));
  form.addEventListener("submit", () => sprag.drafts.submitted(form));
}
