// The form for a new study: checked by the server while it is filled in; the drawing and one line explain the current field.
"use strict";

let form = document.getElementById("study-form");
let waiting = null, latest = 0;
const touched = new Set();
let old = false; // the panel is out of date; it is requested again once the connection is restored
let redrawn = false; // the form was made again for its drawings
let whole = false; // after a full check, empty required fields are reported too

let typed = ""; // name of a field that was left with another text: several values in it vary, and a refinement has fields of its own
let edited = ""; // name of the field that was changed last: what is wrong with a whole part is shown beside it

const encoded = (extra = []) => new URLSearchParams([...new FormData(form), ["edited", edited], ...extra]);

// The input is sent with the button to the login, and comes back from there.
const ended = () => {
  old = false;
  const panel = document.getElementById("panel"), note = document.createElement("p"), button = document.createElement("button");
  note.className = "fault";
  note.setAttribute("role", "alert");
  Object.assign(button, { name: "do", value: "check", textContent: sprag.say("Log in") });
  button.dataset.login = "";
  note.append(sprag.say("Your session has ended."), " ", button, " ", sprag.say("What you typed is kept."));
  panel.classList.remove("stale");
  panel.replaceChildren(note);
};

const fail = (text) => {
  const note = document.createElement("p");
  note.className = "fault";
  note.setAttribute("role", "alert");
  note.textContent = sprag.say("The input could not be checked: {why}", { why: text });
  const panel = document.getElementById("panel");
  panel.classList.remove("stale");
  panel.querySelector(".cost")?.remove();
  panel.querySelector(".fault[role=alert]")?.remove();
  panel.prepend(note);
};

// Open the parts of the form that something is in.
const reveal = (element) => { for (let part = element; (part = part.parentElement?.closest("details"));) part.open = true; };

const check = async () => {
  const mine = ++latest, left = typed, panel = document.getElementById("panel");
  old = true;
  delete form.dataset.checked;
  panel.classList.toggle("stale", panel.querySelector("[data-cases]") !== null); // until it matches the current input
  let found = null;
  try {
    const answer = await sprag.fetch(form.dataset.check, { method: "POST", body: encoded() });
    if (answer.status === 401) { ended(); return; }
    found = await answer.json();
    if (!answer.ok) throw new Error(found.detail);
  } catch (error) {
    if (mine === latest && !(error instanceof sprag.LostError)) fail(error.message);
    return;
  }
  if (mine !== latest) return;
  old = false;
  panel.classList.remove("stale");
  for (const place of form.querySelectorAll(".wrong")) {
    const name = place.id.slice("wrong:".length);
    const field = document.getElementById(name);
    const told = whole || touched.has(name) || !field || field.value !== "";
    const messages = told ? found.faults[name] || [] : [];
    const text = messages.join(name === "/text" ? "\n" : ". ");
    if (place.textContent !== text) {
      place.textContent = text;
      if (text) reveal(place);
    }
    if (field) field.toggleAttribute("aria-invalid", messages.length > 0);
    if (field && messages.length) field.setAttribute("aria-invalid", "true");
  }
  for (const place of form.querySelectorAll(".wrong")) {
    const texts = (found.beside || {})[place.id.slice("wrong:".length)] || [];
    if (place.nextElementSibling?.matches(".hint")) place.nextElementSibling.remove();
    if (texts.length) place.after(Object.assign(document.createElement("span"), { className: "hint", textContent: texts.join("\n") }));
  }
  const pictures = form.querySelectorAll(".picture");
  if (pictures.length === (found.pictures || []).length) pictures.forEach((place, index) => { place.innerHTML = found.pictures[index]; });
  else if (!pictures.length && !redrawn) { redrawn = true; reshape([]); } // a page that was made before the service could draw
  for (const range of form.querySelectorAll("a.range")) range.textContent = (found.spans || {})[range.id] || range.textContent;
  const go = document.getElementById("go");
  if (go && found.run) go.textContent = found.run;
  const open = [...panel.querySelectorAll("details")].map((part) => part.open);
  panel.innerHTML = found.panel;
  panel.querySelectorAll("details").forEach((part, index) => { part.open = Boolean(open[index]); });
  for (const place of form.querySelectorAll(".fit")) place.innerHTML = found.fits[place.id.slice("fit:".length)] || "";
  form.dataset.checked = String(mine);
  document.dispatchEvent(new Event("sprag:checked"));
  if (!left || document.activeElement.name === left) return;
  typed = typed === left ? "" : typed;
  if (found.rows !== form.querySelector("section.varies")?.dataset.rows) reshape([]);
};

// The text of a file in UTF-8, UTF-16 with a byte order mark, or a code page of Windows, as `decoded` in table_text.py has it.
const textOf = async (file) => {
  const bytes = new Uint8Array(await file.arrayBuffer());
  const text = (encoding, fatal = false) => new TextDecoder(encoding, { fatal }).decode(bytes);
  if (bytes[0] === 0xff && bytes[1] === 0xfe) return text("utf-16le");
  if (bytes[0] === 0xfe && bytes[1] === 0xff) return text("utf-16be");
  try { return text("utf-8", true); } catch { /* not UTF-8 */ }
  const cyrillic = text("windows-1251");
  return /(?<!\p{L})\p{Script=Cyrillic}{2,}(?!\p{L})/u.test(cyrillic) ? cyrillic : text("windows-1252");
};

// The text of a chosen file goes into the field that is sent; the file itself is not.
const takeFile = async (event) => {
  const file = event.target.files && event.target.files[0];
  if (!file || !event.target.dataset.into) return;
  const field = document.getElementById(event.target.dataset.into);
  field.value = await textOf(file);
  edited = field.name;
  touched.add(field.name);
  soon();
};

const soon = () => { clearTimeout(waiting); waiting = setTimeout(check, 300); };

// Another pendulum or axis: the server rebuilds the form with the current input.
let reshaping = false;
const reshape = async (extra) => {
  if (reshaping) return;
  reshaping = true;
  try { await newShape(extra); } finally { reshaping = false; }
};

// After a button: the first new field, the same button, or the one beside it where it has nothing left to do. After a choice: the choice.
const focusAfter = (asked, known, { name: chosen, type, value, id }) => {
  const button = (value) => form.querySelector(`button[value="${CSS.escape(value)}"]:enabled`);
  const first = [...form.elements].find((element) => element.id && !known.has(element.id) && !element.matches("fieldset"));
  const same = asked ? [asked, asked.replace(/^drop-(\S+).*/, "add-$1"), "check"].map(button).find(Boolean)
    : chosen ? form.querySelector(`[name="${CSS.escape(chosen)}"]${type === "radio" ? ":checked" : type === "submit" ? `[value="${CSS.escape(value)}"]` : ""}`)
    : id ? document.getElementById(id) : null;
  (asked ? first || same : same)?.focus();
};

const MOST_ASKED = 4;
// Whether the form has come.
const newShape = async (extra, draft = null) => {
  let answer = null, body = null;
  const current = () => String(draft ?? encoded(extra));
  try {
    for (let asked = 0; asked < MOST_ASKED && body !== current(); asked += 1) { // again with what was typed or ticked meanwhile
      clearTimeout(waiting);
      latest += 1;
      body = current();
      answer = await sprag.fetch(form.action, { method: "POST", body: new URLSearchParams(body), headers: { Accept: "text/html" } });
    }
  } catch (error) { return false; } // the bar reports it; the input is kept
  if (answer.status === 401) { ended(); return false; }
  const page = new DOMParser().parseFromString(await answer.text(), "text/html");
  const fresh = page.getElementById("study-form");
  if (!fresh) { fail(page.querySelector("main p")?.textContent || sprag.refusal(answer)); return false; }
  const known = new Set([...form.elements].map((element) => element.id || element.value));
  const before = document.activeElement;
  const named = (part) => part.id || `${part.closest("fieldset[id]")?.id} ${part.querySelector("summary").textContent}`;
  const added = [...fresh.querySelectorAll(".fold")].some((part) => !document.getElementById(part.id)); // which alone is open
  const opened = new Set([...form.querySelectorAll(`details[open]${added ? ":not(.fold)" : ""}`)].map(named));
  const live = document.getElementById("live");
  if (live) fresh.querySelector("#live")?.replaceWith(live); // until it is computed for the new form
  form.replaceWith(document.adoptNode(fresh));
  form = fresh;
  for (const part of form.querySelectorAll("details")) part.open ||= opened.has(named(part));
  listen();
  focusAfter(extra[0]?.[1], known, before);
  const unused = form.querySelector('[id="wrong:/columns"]');
  if (unused?.textContent) unused.closest("details").scrollIntoView({ block: "nearest" });
  else if (!whole) check();
  sprag.drafts.keep(form);
  return true;
};

// The dimension of the field that has the focus stands out in the drawing, and one line says what it means.
const explain = (event) => {
  for (const part of document.querySelectorAll("[data-mark].shown")) part.classList.remove("shown");
  const path = (event.target.name ?? "").replace(/^\/base\//, "").replaceAll("/", ".");
  if (path) document.querySelector(`[data-mark="${CSS.escape(path)}"]`)?.classList.add("shown");
  const line = document.getElementById("explain"), { help, more } = event.target.dataset;
  if (!line || !(help || more)) return;
  const [text, link] = line.children;
  text.textContent = help || event.target.labels?.[0]?.textContent || event.target.getAttribute("aria-label") || "";
  link.hidden = !more;
  if (more) { link.href = more; link.setAttribute("aria-label", sprag.say("Explanation: {label}", { label: event.target.labels?.[0]?.textContent.trim() || "" })); }
};

// A dimension is one stop of the Tab key: Enter opens its unit and its ticks, Escape leads back.
const GROUPS = ".dim, .axis .line";
const ownOf = (group) => [...group.querySelectorAll("a.range, .entry:not(.tolerance) > input:not([type=hidden])")];
const othersOf = (group) => {
  const all = group.matches(".line") ? group.closest(".axis") : group;
  return [...all.querySelectorAll("select, summary, button, input:not([type=hidden])")].filter((one) => !ownOf(group).includes(one) && !one.closest("details:not([open]) > .fields"));
};
const close = (group) => { for (const one of othersOf(group)) one.tabIndex = -1; };
const stops = () => { for (const group of form.querySelectorAll(GROUPS)) if (ownOf(group).length) close(group); };
const open = (event) => {
  const group = event.target.closest(".dim") || event.target.closest(".axis")?.querySelector(".line");
  if (!group || !ownOf(group).length) return;
  const own = ownOf(group);
  if (event.key === "Escape" && !own.includes(event.target)) { close(group); own[0].focus(); }
  if (event.key !== "Enter" || !own.includes(event.target) || event.target.matches("a")) return;
  event.preventDefault();
  const others = othersOf(group).filter((one) => one.checkVisibility());
  for (const one of others) one.tabIndex = 0;
  others[0]?.focus();
};
const left = (event) => {
  const group = event.target.closest(".dim, .axis");
  if (group && !group.contains(event.relatedTarget)) for (const one of group.matches(".dim") ? [group] : group.querySelectorAll(".line")) close(one);
};

// A pasted column or row of a spreadsheet becomes a list of values, several columns become axes.
const paste = (event) => {
  const text = event.clipboardData.getData("text");
  const columns = document.getElementById("/columns");
  if (columns && event.target.name?.startsWith("/axes/") && /\t.*\n.*\t/.test(text.trim())) {
    event.preventDefault();
    columns.value = text;
    form.querySelector('button[value="take-columns"]').click();
    return;
  }
  if (!/\/(values|plus_minus)$/.test(event.target.name ?? "") || !/[\t\n]/.test(text.trim())) return;
  event.preventDefault();
  const field = event.target, list = text.split(/[\t\r\n]+/).map((part) => part.trim()).filter(Boolean).join("; ");
  field.setRangeText(list, field.selectionStart, field.selectionEnd, "end");
  field.dispatchEvent(new Event("input", { bubbles: true }));
  field.dispatchEvent(new Event("change", { bubbles: true }));
};

// What a field had before it was changed, for the button that undoes it: service/http/web/form/undo.py.
let shown = {};
const snapshot = () => {
  const { history, key, ...fields } = Object.fromEntries(new FormData(form));
  return fields;
};
const remember = (event) => {
  const history = form.elements.namedItem("history");
  if (!history || "moves" in event.target.dataset) return; // the server moves fields, and remembers it
  const fields = snapshot(), change = {};
  for (const name of new Set([...Object.keys(shown), ...Object.keys(fields)])) {
    if (shown[name] !== fields[name]) change[name] = shown[name] ?? null;
  }
  shown = fields;
  if (!Object.keys(change).length) return;
  history.value = JSON.stringify([...JSON.parse(history.value || "[]"), change].slice(-30));
  form.querySelector('button[value="undo"]').disabled = false;
};

function listen() {
  shown = snapshot();
  form.addEventListener("paste", paste);
  form.addEventListener("change", remember);
  form.addEventListener("input", (event) => { edited = event.target.name; soon(); sprag.drafts.keep(form); });
  stops();
  form.addEventListener("focusin", explain);
  form.addEventListener("keydown", open);
  form.addEventListener("focusout", left);
  form.addEventListener("focusout", (event) => { if (event.target.name) { touched.add(event.target.name); soon(); } });
  form.addEventListener("change", (event) => { if (event.target.matches(":is(.dim, .axis) .entry > input")) typed = event.target.name; });
  form.addEventListener("change", (event) => { if (event.target.matches("[data-shape]")) reshape([]); });
  form.addEventListener("change", takeFile);
  form.addEventListener("submit", (event) => {
    const button = event.submitter;
    if (button && button.matches("[data-shape]")) {
      event.preventDefault();
      reshape([["do", button.value]]);
    } else if (button?.value === "submit") {
      sprag.drafts.submitted(form);
    } else if (button && button.value === "check" && !button.matches("[data-login]")) {
      event.preventDefault();
      whole = true;
      check();
    }
  });
}

// After a refused submission: go to the first faulty field, or to the first message without a field.
const refused = form.querySelector("[aria-invalid]") || form.querySelector(".wrong:not(:empty), #panel .fault");
if (refused) {
  whole = true;
  if (!refused.matches("input, select, textarea")) refused.tabIndex = -1;
  refused.focus();
  refused.scrollIntoView({ block: "center" });
}
listen();
// An address that has the name of a field leads into it, and so does a letter of a drawing.
const lead = (address) => {
  const asked = document.getElementById(decodeURIComponent(address.slice(1)));
  if (!asked || !form.contains(asked)) return false;
  reveal(asked);
  asked.focus();
  asked.select?.();
  return true;
};
if (!refused) lead(location.hash);
document.addEventListener("click", (event) => {
  const link = event.target.closest?.("#study-form a[href^='#/']");
  if (link && lead(link.getAttribute("href"))) event.preventDefault();
});
if (!("checked" in form.dataset)) check();
const draft = sprag.drafts.waiting(form, Boolean(refused));
if (draft) sprag.drafts.offer(form, draft, (fields) => newShape([], new URLSearchParams(fields)));
document.addEventListener("sprag:found", () => { if (old) check(); });
