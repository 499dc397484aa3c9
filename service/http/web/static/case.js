// The motion of a case: figures from the server, which recomputes a zoomed part. The table of its
// engagements is loaded from its own page.
"use strict";

const motion = document.getElementById("motion"), phase = document.getElementById("phase");

const showMotion = async (address) => {
  const figures = await sprag.fetchJson(sprag.narrowed(motion, address));
  await sprag.show(motion, figures.motion);
  if (phase && figures.phase) await sprag.show(phase, figures.phase);
};

if (motion) {
  const whole = motion.dataset.motion;
  let waiting = null, shown = whole;
  const zoomTo = async (address) => {
    motion.classList.add("stale");
    try {
      await sprag.busy(motion, showMotion(address));
      motion.classList.remove("stale");
    } catch (error) {
      if (!(error instanceof sprag.LostError)) sprag.note(motion, error.message, () => zoomTo(address));
    }
  };
  const change = (address) => {
    clearTimeout(waiting);
    if (address === shown) return;
    waiting = setTimeout(() => { shown = address; zoomTo(address); }, 250);
  };
  document.addEventListener("DOMContentLoaded", async () => {
    try {
      await sprag.busy(motion, showMotion(whole));
    } catch (error) {
      sprag.note(motion, error.message, () => location.reload());
      if (error instanceof sprag.LostError) document.addEventListener("sprag:found", () => location.reload(), { once: true });
      return;
    }
    if (sprag.figures.get(motion)?.zoom) motion.on("plotly_relayout", (event) => {
      const low = event["xaxis.range[0]"], high = event["xaxis.range[1]"];
      if (low !== undefined && high > low) {
        const url = new URL(whole, location.href), ends = [Number(url.searchParams.get("from")), Number(url.searchParams.get("to"))];
        url.searchParams.set("from", String(Math.max(low, ends[0])));
        url.searchParams.set("to", String(Math.min(high, ends[1])));
        change(url.pathname + url.search);
      } else if (event["xaxis.autorange"]) change(whole);
    });
    document.addEventListener("sprag:found", () => { if (motion.classList.contains("stale")) zoomTo(shown); });
  });
}

const engagements = document.getElementById("engagements");
if (engagements) document.addEventListener("DOMContentLoaded", async () => {
  try {
    sprag.take(await sprag.busy(engagements, sprag.page(engagements.dataset.engagements)), "#engagements");
  } catch (error) {
    sprag.note(engagements, error.message, () => location.reload());
  }
});
