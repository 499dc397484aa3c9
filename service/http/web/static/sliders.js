// Sliders beside fields: the text that a position stands for, and the position of a text.
"use strict";

// Sliders that show another unit than SI move in that unit, and write it beside the number.
sprag.slider = (() => {
  const endsOf = (slider) => [slider.dataset.low, slider.dataset.high].map((end) => Number(end) / Number(slider.dataset.factor || 1));

  const textOf = (slider) => {
    const [low, high] = endsOf(slider), share = slider.value / 1000;
    const value = "log" in slider.dataset ? low * (high / low) ** share : low + (high - low) * share;
    return [String(Number(value.toPrecision(4))), slider.dataset.shown].filter(Boolean).join(" ");
  };

  // Null for units of which only the server knows.
  const positionOf = (slider, text) => {
    const [, digits, unit] = text.trim().match(/^([-+\d.eE]+)\s*(.*)$/) || [];
    if (!digits || !Number.isFinite(Number(digits)) || (unit && unit !== slider.dataset.shown)) return null;
    const value = unit ? Number(digits) : Number(digits) / Number(slider.dataset.factor || 1);
    const [low, high] = endsOf(slider);
    const share = "log" in slider.dataset ? Math.log(value / low) / Math.log(high / low) : (value - low) / (high - low);
    return Math.min(Math.max(1000 * share, 0), 1000);
  };

  // The unit beside a field is that of plain numbers; a text with a unit of its own needs none.
  const unitOf = (field) => {
    const unit = field.parentElement.querySelector(".unit");
    if (unit) unit.hidden = /[^-+\d.,eE\s]/.test(field.value);
  };

  // Let each slider of a form write into its field, and each field place its slider; `changed` hears of both.
  const wire = (form, changed) => {
    for (const field of form.querySelectorAll(".entry input")) {
      const slider = form.querySelector(`[data-for="${CSS.escape(field.id)}"]`);
      field.addEventListener("input", () => {
        if (slider) slider.value = positionOf(slider, field.value) ?? slider.value;
        unitOf(field);
        changed();
      });
      slider?.addEventListener("input", () => {
        field.value = textOf(slider);
        slider.setAttribute("aria-valuetext", field.value);
        unitOf(field);
        changed();
      });
    }
  };
  return { wire };
})();
