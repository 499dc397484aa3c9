// The page of a case: its drawing moves, and what was not ready when the page came is asked for once more.
"use strict";

// The drawing moves as the motion does.
const moved = () => {
  const data = document.getElementById("frames");
  if (document.getElementById("instant")) sprag.sheet.move(data ? JSON.parse(data.textContent) : null);
};

document.addEventListener("DOMContentLoaded", async () => {
  moved();
  const parts = [...document.querySelectorAll(".seen:has([data-later])")];
  if (!parts.length) return;
  const again = new URL(location.href);
  again.searchParams.set("wait", "1");
  try {
    const page = await sprag.busy(parts[0], sprag.page(again.pathname + again.search));
    for (const part of parts) sprag.take(page, `#${part.id}`);
    moved();
  } catch (error) {
    for (const part of parts) sprag.note(part, error.message, () => location.reload());
  }
});
