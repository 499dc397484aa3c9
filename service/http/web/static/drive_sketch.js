// The sketch of a vibration drive: frames of the server shown one by one, in slow motion or by hand.
"use strict";

sprag.sketch = (() => {
  const SECONDS = 3; // of an excitation period on the page
  const svg = document.getElementById("sketch"), play = document.getElementById("play"), instant = document.getElementById("instant");
  const reading = document.getElementById("reading"), plot = document.getElementById("lab-plot");
  const looks = JSON.parse(svg.dataset.looks), wording = JSON.parse(svg.dataset.words);
  const parts = (name) => [...svg.querySelectorAll(`[data-${name}]`)];
  const base = parts("base")[0], arms = parts("arm"), springs = parts("spring"), clutches = parts("clutch"), shafts = parts("shaft");
  const words = parts("clutch-word"), shaftWord = parts("shaft-word")[0];
  let frames = null, playing = false, from = 0, began = 0, turned = 0;

  const named = (state) => frames.states[state];
  const worded = (state) => wording[named(state)];

  const draw = (at) => {
    base.setAttribute("transform", `translate(${frames.x[at]} ${-frames.y[at]})`);
    frames.pendulums.forEach((pendulum, k) => {
      const angle = pendulum.angle[at], tip = Number(springs[k].dataset.spring);
      arms[k].setAttribute("transform", `rotate(${-angle} 130 0)`);
      springs[k].setAttribute("transform", `scale(${Math.max(110 + tip * 70 * Math.sin(angle * Math.PI / 180), 5) / 110} 1)`);
      clutches[k].setAttribute("fill", looks[named(pendulum.state[at])][0]);
      words[k].textContent = worded(pendulum.state[at]);
    });
    for (const shaft of shafts) shaft.setAttribute("transform", `rotate(${-(turned + frames.shaft.angle[at])} 130 0)`);
    shaftWord.textContent = worded(frames.shaft.state[at]);
    svg.dataset.frame = String(at);
  };

  const last = () => frames.x.length - 1;
  const period = (at) => frames.periods * at / last();

  // The line in the curves stands where the sketch does, and is absent while it moves.
  const mark = (at) => sprag.mark(plot, playing ? null : period(at));

  const read = (at) => {
    reading.textContent = sprag.say("t = {time} ms, excitation period {at} of {n}; shaft {speed} rad/s.", {
      time: sprag.decimal(frames.time[at].toPrecision(4)), at: sprag.decimal(period(at).toFixed(3)),
      n: Math.round(frames.periods), speed: sprag.decimal(frames.shaft.speed[at].toPrecision(4)),
    });
    instant.setAttribute("aria-valuetext", reading.textContent);
  };

  const step = (now) => {
    if (!playing || !frames) return;
    const whole = 1000 * SECONDS * frames.periods;
    while (now - began >= whole) { began += whole; turned = (turned + frames.shaft.angle[last()]) % 360; }
    const at = Math.round(Math.max(now - began, 0) / whole * last());
    instant.value = at;
    draw(at);
    requestAnimationFrame(step);
  };

  const run = (on) => {
    playing = on && frames !== null;
    play.textContent = playing ? sprag.say("Pause") : sprag.say("Play");
    play.setAttribute("aria-pressed", String(playing));
    if (!frames) return;
    from = Number(instant.value);
    if (playing) {
      reading.textContent = sprag.say("In slow motion: one excitation period takes {n} s.", { n: SECONDS });
      began = performance.now() - 1000 * SECONDS * frames.periods * from / last();
      requestAnimationFrame(step);
    } else read(from);
    mark(from);
  };

  play.addEventListener("click", () => run(!playing));
  instant.addEventListener("input", () => {
    if (!frames) return;
    if (playing) run(false);
    const at = Number(instant.value);
    draw(at); read(at); mark(at);
  });

  let first = true;
  // Show the frames of a new motion at the same part of its turn.
  const show = (given) => {
    const share = frames && last() ? Number(instant.value) / last() : 0;
    frames = given;
    svg.classList.toggle("stale", !given);
    if (!given) { run(false); return; }
    instant.max = last();
    instant.value = Math.round(share * last());
    turned = 0;
    draw(Number(instant.value));
    if (first) { first = false; playing = !matchMedia("(prefers-reduced-motion: reduce)").matches; }
    run(playing);
  };
  return { show };
})();
