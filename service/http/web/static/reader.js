// The reader: the time zone of the browser for the times of pages, and the units of this page in its address, so that a
// colleague who gets it sees the same numbers.
"use strict";

(() => {
  const { zone, units } = document.documentElement.dataset;
  const own = Intl.DateTimeFormat().resolvedOptions().timeZone;
  // `zone` is that of the times on the page, and empty where somebody chose one.
  if (zone && own && own !== zone) {
    document.cookie = `sprag_here=${encodeURIComponent(own)}; path=${sprag.prefix || "/"}; max-age=31536000; samesite=lax`;
    const known = document.cookie.includes("sprag_here="), named = document.getElementById("times");
    if (known && named) named.textContent = named.textContent.replace(zone, own);
    if (known && document.querySelector("time")) sprag.page(location.href).then((page) => {
      const times = page.querySelectorAll("time");
      document.querySelectorAll("time").forEach((time, place) => { if (times[place]) time.replaceWith(times[place].cloneNode(true)); });
    }).catch(() => {});
  }
  document.querySelectorAll("input[data-here]").forEach((field) => { field.value ||= own; });
  const address = new URL(location.href);
  if (units && !address.searchParams.has("units")) {
    address.searchParams.set("units", units);
    history.replaceState(history.state, "", address);
  }
})();
