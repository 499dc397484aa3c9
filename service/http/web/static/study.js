// Choices take effect immediately. The server makes every part.
"use strict";

// A form with data-swap: a change shows the new page's part (and that of data-also, above the form), and puts its address
// into the window. What is chosen is an entry of the history, as it is without scripts; what is typed or dragged replaces
// the current one.
const swapping = (form) => {
  let latest = 0, asked = null, shown = location.search;
  const CHOSEN = "select, [type=checkbox], [type=radio]";

  // The page of an address, if no later one is wanted; a failure is said in the old part, where it can be tried again.
  const fetched = async (address, again) => {
    const mine = ++latest, old = document.querySelector(form.dataset.swap);
    asked = again;
    old.classList.add("stale"); // it does not match the current choices
    try {
      const page = await sprag.busy(old, sprag.page(address));
      if (mine !== latest) return null;
      asked = null;
      return page;
    } catch (error) {
      if (mine === latest && !(error instanceof sprag.LostError)) { asked = null; sprag.note(old, error.message, again); old.classList.remove("stale"); }
      return null;
    }
  };
  // Saved views and the report use the choices too; what is typed in their forms stays.
  const FOLLOW = ["#view-query", "#report-curves"];
  // What is wrong with a field stands beside it; the field stays, because somebody may be typing in it.
  const mark = (page) => {
    for (const note of form.querySelectorAll(".wrong")) {
      note.textContent = page.getElementById(note.id)?.textContent ?? "";
      const field = form.elements.namedItem(note.id.slice("wrong:".length));
      if (note.textContent) field?.setAttribute("aria-invalid", "true");
      else field?.removeAttribute("aria-invalid");
    }
  };
  const show = async (page) => {
    const part = sprag.take(page, form.dataset.swap);
    part.classList.remove("stale");
    for (const also of [form.dataset.also, ...FOLLOW]) if (also) sprag.take(page, also);
    shown = location.search;
    await sprag.drawAll?.(part);
  };

  const swap = async (push) => {
    const chosen = new URLSearchParams([...new FormData(form)].filter(([, value]) => value !== ""));
    const address = `${location.pathname}?${chosen}`, page = await fetched(address, () => swap(push));
    if (!page) return;
    const focused = document.activeElement;
    const place = focused && focused.name ? [focused.name, focused.value] : null;
    if (!(focused && focused.closest && focused.closest("#held"))) sprag.take(page, "#held");
    const summary = form.querySelector("details.results summary"), fresh = page.querySelector("details.results summary");
    if (summary && fresh) summary.textContent = fresh.textContent;
    mark(page);
    history[push && address !== location.pathname + location.search ? "pushState" : "replaceState"](null, "", address);
    const drawn = show(page);
    if (place && document.activeElement === document.body) {
      const again = form.elements.namedItem(place[0]);
      if (again && again.focus) again.focus();
    }
    await drawn;
  };
  // Back and forward: the choices are those of the address.
  const go = async () => {
    const page = await fetched(location.href, go), fresh = page?.querySelector("form[data-swap]");
    if (!fresh) return;
    form.replaceChildren(...document.adoptNode(fresh).childNodes);
    await show(page);
  };
  form.addEventListener("change", (event) => swap(event.target.matches(CHOSEN)));
  // Enter after a change shows its page too, in one entry of the history and without the fields that are empty.
  form.addEventListener("submit", (event) => { event.preventDefault(); swap(true); });
  window.addEventListener("popstate", () => { if (form.isConnected && location.search !== shown) go(); });
  document.addEventListener("sprag:found", () => { if (form.isConnected) asked?.(); });
};
for (const form of document.querySelectorAll("form[data-swap]")) swapping(form);
// A part that takes the place of another one may have such a form.
document.addEventListener("sprag:drawn", (event) => { for (const form of event.target.querySelectorAll("form[data-swap]")) swapping(form); });
