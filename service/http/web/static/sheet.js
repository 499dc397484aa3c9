// The motion of the machine as it is drawn: computed again whenever the form is sound, and played in its drawing.
"use strict";

sprag.sheet = (() => {
  const SECONDS = 3, TURN = 4, STILL = 7; // of an excitation period and of a turn of the shaft on the page; degrees of a pendulum that is drawn still
  let frames = null, playing = !matchMedia("(prefers-reduced-motion: reduce)").matches, at = 0, began = 0, busy = false, again = false, started = false, answered = "";
  const one = (id) => document.getElementById(id);
  const drawings = () => [...document.querySelectorAll(".picture svg")];

  // The ends of the lines from labels and fields follow what they point at, and so do letters.
  const follow = (svg, place) => {
    for (const mark of svg.querySelectorAll("[data-on]")) {
      const still = mark.dataset.at.split(" ").map(Number), [x, y] = place(mark.dataset.on, ...still);
      if (mark.matches(".letter")) mark.setAttribute("transform", `translate(${x - still[0]} ${y - still[1]})`);
      else mark.setAttribute("d", `${mark.getAttribute("d").split("L")[0]}L${x} ${y}`);
    }
  };

  const drive = (step) => {
    drawings().forEach((svg, index) => {
      const pendulum = frames.pendulums[index], wheel = svg.querySelector("[data-clutch]");
      if (!pendulum || !wheel) return;
      svg.classList.add("moving");
      const [x, y] = ["cx", "cy"].map((name) => Number(wheel.getAttribute(name))), angle = pendulum.angle[step];
      svg.querySelector("[data-base]").setAttribute("transform", `translate(${frames.x[step]} ${-frames.y[step]})`);
      svg.querySelector("[data-arm]").setAttribute("transform", `rotate(${-angle} ${x} ${y})`);
      svg.querySelector("[data-shaft]").setAttribute("transform", `rotate(${-frames.shaft[step]} ${x} ${y})`);
      wheel.classList.toggle("engaged", pendulum.engaged[step]);
      const spring = svg.querySelector("[data-spring]"), sine = (degrees) => Math.sin(degrees * Math.PI / 180);
      const [sin, cos] = [sine(STILL - angle), sine(90 + STILL - angle)];
      follow(svg, (on, a, b) => {
        const [across, down] = on === "arm" ? [(a - x) * cos - (b - y) * sin, (a - x) * sin + (b - y) * cos] : [a - x, b - y];
        return [x + across + frames.x[step], y + down - frames.y[step]];
      });
      if (spring) {
        const span = Number(spring.dataset.span), moved = Number(spring.dataset.spring) * (sine(angle) - sine(STILL));
        spring.setAttribute("transform", `scale(${Math.max(span - moved, 8) / span} 1)`);
      }
    });
  };

  // Frames of a linkage a few degrees apart, and straight lines between them.
  const linkage = (svg, degrees) => {
    svg.frames ||= JSON.parse(svg.dataset.frames);
    const own = degrees * (svg.frames.ratio || 1); // of a shaft that is geared to the main one
    const between = (list) => {
      const place = ((own % 360 + 360) % 360) / 360 * (list.length - 1), first = Math.min(Math.floor(place), list.length - 2), share = place - first;
      const [a, b] = [list[first], list[first + 1]];
      return Array.isArray(a) ? a.map((value, index) => value + (b[index] - value) * share) : a + (b - a) * share;
    };
    const joints = Object.fromEntries(Object.entries(svg.frames.joints).map(([name, list]) => [name, between(list)]));
    for (const bar of svg.querySelectorAll("[data-bar]")) bar.setAttribute("points", bar.dataset.bar.split(" ").map((name) => joints[name].join(",")).join(" "));
    for (const plate of svg.querySelectorAll("[data-plate]")) {
      const [name, turn] = plate.dataset.plate.split(" ");
      plate.setAttribute("transform", `translate(${joints[name].join(" ")}) rotate(${between(svg.frames.turns[turn])})`);
    }
    for (const joint of svg.querySelectorAll("[data-joint]")) {
      const [x, y] = joints[joint.dataset.joint];
      joint.setAttribute("cx", x);
      joint.setAttribute("cy", y);
    }
    follow(svg, (on) => {
      const [first, last, share, below] = on.split(" "), [a, b] = [joints[first], joints[last]];
      return [a[0] + (b[0] - a[0]) * share, a[1] + (b[1] - a[1]) * share + Number(below)];
    });
  };

  const show = () => {
    const dial = one("instant");
    if (frames) drive(Math.min(Math.max(Math.round(at), 0), frames.x.length - 1));
    else for (const svg of drawings().filter((each) => each.dataset.frames)) linkage(svg, at);
    if (dial) dial.value = Math.round(at);
  };

  const moves = () => frames || drawings().some((svg) => svg.dataset.frames);
  const step = (now) => {
    if (!playing || !moves() || !one("instant")) { started = false; return; }
    const last = Number(one("instant").max), whole = 1000 * (frames ? SECONDS * frames.periods : TURN * last / 360);
    at = (Math.max(now - began, 0) % whole) / whole * last; // the first frame can be older than the click
    show();
    requestAnimationFrame(step);
  };
  const play = (on) => {
    playing = on;
    const button = one("play");
    if (!button) return;
    button.textContent = playing ? sprag.say("Pause") : sprag.say("Play");
    button.setAttribute("aria-pressed", String(playing));
    if (playing && !started) { started = true; began = performance.now(); requestAnimationFrame(step); }
  };

  // Move the drawings by frames, or by their own; the button plays, the slider shows an instant.
  const move = (given) => {
    frames = given;
    const button = one("play"), dial = one("instant");
    if (button) button.onclick = () => play(!playing); // the page may give further frames to the same button
    if (dial) dial.oninput = () => { play(false); at = Number(dial.value); show(); };
    show();
    play(playing);
  };

  const post = (address, body) => sprag.fetchJson(address, { method: "POST", body });
  // One request at a time; of later changes the last is sent when the answer has arrived.
  const ask = async () => {
    if (busy) { again = true; return; }
    busy = true;
    const place = one("live");
    try {
      const body = encoded(), address = `${place.dataset.live}?width=${Math.max(Math.min(Math.round(place.clientWidth), 1200), 240)}`;
      if (answered === address + body) { if (frames) show(); return; } // a field was only left
      const found = await post(address, body);
      answered = address + body;
      place.classList.toggle("stale", !found.answer);
      if (found.answer) {
        const focused = document.activeElement?.id;
        place.innerHTML = found.answer;
        if (["play", "instant"].includes(focused)) one(focused)?.focus();
        move(found.frames);
        const { sparks } = await post(place.dataset.along, body);
        for (const each of document.querySelectorAll(".spark")) if (each.id) each.innerHTML = sparks[each.id.slice("spark:".length)] || "";
      }
    } catch (error) {
      answered = "";
      place.classList.add("stale");
    } finally {
      busy = false;
      if (again) { again = false; ask(); }
    }
  };
  return { ask, move };
})();

document.addEventListener("sprag:checked", () => { if (document.getElementById("live")) sprag.sheet.ask(); });
document.addEventListener("DOMContentLoaded", () => { if (document.getElementById("live")) { sprag.sheet.ask(); } });
