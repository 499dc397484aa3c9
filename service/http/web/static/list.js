// The list of studies, kept up to date; ticked boxes stay ticked.
"use strict";

const SECONDS = 5;

const look = async () => {
  if (document.hidden) return;
  const page = await sprag.page(location.href).catch(() => null);
  if (!page) return;
  const ticked = new Set([...document.querySelectorAll("#studies input:checked")].map((box) => box.value));
  const part = document.querySelector("#studies") && page.querySelector("#studies") ? "#studies" : "#list";
  sprag.take(page, part);
  for (const box of document.querySelectorAll("#studies input[name=study]")) box.checked = ticked.has(box.value);
};

setInterval(look, 1000 * SECONDS);
document.addEventListener("visibilitychange", look);
document.addEventListener("sprag:found", look);
