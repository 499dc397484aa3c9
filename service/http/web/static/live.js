// Pages that show what changes: one stream of events for a tab, and the parts of the page that have changed, from the server.
"use strict";

// Enter among the tags of a list gives the chosen studies these tags; the first button of the form would compare them.
document.addEventListener("keydown", (event) => {
  const own = event.key === "Enter" && event.target.form?.querySelector('button[name="do"][value="tag"]');
  if (own && event.target.name === "tags") { event.preventDefault(); own.click(); }
});

(() => {
  const root = document.querySelector("[data-events]");
  if (!root) return;
  const QUICK = 700, SLOW = 3000, AGAIN = 10000; // ms from an event to the page; between tables and figures; after a refusal
  const whole = `#${root.id}`;
  for (const part of document.querySelectorAll("[data-live]")) part.served = part.outerHTML;
  let address = root.dataset.events, source = null, timer = null, drawn = 0, ended = false;

  const refresh = async () => {
    timer = null;
    const last = ended, here = location.href, page = await sprag.page(here).catch(() => null);
    if (!page || here !== location.href) return;
    const slow = last || Date.now() - drawn >= SLOW;
    if (slow) drawn = Date.now();
    // With the end other things can be done and asked.
    if (last && root.dataset.whole) sprag.take(page, root.dataset.whole, { keep: true });
    else for (const { id, dataset } of document.querySelectorAll("[data-live]")) {
      if (dataset.live === "slow" && (!slow || document.querySelector(".stale"))) continue;
      // A list that has become empty has another shape.
      sprag.take(page, page.getElementById(id) ? `#${id}` : whole, { keep: true });
    }
    if (slow && sprag.draw) for (const plot of document.querySelectorAll(".plot[data-figure]")) sprag.draw(plot);
    follow();
  };
  // The page that has come says what else to wait for, such as another of the studies that it compares.
  const follow = () => {
    const next = document.getElementById(root.id)?.dataset.events;
    if (next === address) return;
    [address, ended] = [next, !next];
    listen();
  };
  const close = () => { source?.close(); source = null; };
  const listen = () => {
    close();
    if (ended) return;
    const mine = source = new EventSource(address);
    mine.addEventListener("progress", () => { timer = timer || setTimeout(refresh, QUICK); });
    mine.addEventListener("end", () => { ended = true; close(); clearTimeout(timer); refresh(); });
    // A stream ends when the service stops, the connection is cut or the session has ended; a request shows which.
    mine.addEventListener("error", async () => {
      await sprag.fetch(`${sprag.prefix}/livez`, { cache: "no-store" }).catch(() => {});
      if (mine.readyState !== EventSource.CLOSED || mine !== source) return;
      setTimeout(() => { if (mine === source) listen(); }, AGAIN);
      refresh();
    });
  };
  document.addEventListener("sprag:found", () => {
    if (!source || source.readyState === EventSource.CLOSED) listen();
    drawn = 0;
    refresh();
  });
  // Browsers allow few connections to a host: tabs that nobody sees have none. The first event of a stream is the present.
  document.addEventListener("visibilitychange", () => document.hidden ? close() : listen());
  window.addEventListener("pagehide", close);
  window.addEventListener("pageshow", (event) => { if (event.persisted) listen(); });
  listen();
})();
