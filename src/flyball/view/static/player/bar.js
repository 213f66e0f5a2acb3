// The control bar: play, scrub, speed, loop, and the keys that do the same.
import { timeDigits } from "./format.js";

const STEP = 1 / 200; // of the whole span, for the arrow keys

/** Wire the bar to the clock; returns what brings the bar up to date. */
export function controlBar(bar, clock) {
  const part = (name) => bar.querySelector(`[name=${name}]`);
  const [play, scrub, speed, loop] = ["play", "scrub", "speed", "loop"].map(part);
  const read = bar.querySelector("output");
  const digits = timeDigits(clock.end - clock.begin);
  Object.assign(scrub, { min: clock.begin, max: clock.end, step: "any" });
  for (const control of [play, scrub, speed, loop]) control.disabled = clock.still;
  bar.querySelector(".total").textContent = ` / ${clock.end.toFixed(digits)} s`;

  play.addEventListener("click", () => clock.play(!clock.playing));
  part("start").addEventListener("click", () => clock.seek(clock.begin));
  speed.addEventListener("change", () => (clock.speed = Number(speed.value)));
  loop.addEventListener("click", () => {
    clock.looping = !clock.looping;
    loop.setAttribute("aria-pressed", String(clock.looping));
  });
  let resume = false;
  scrub.addEventListener("pointerdown", () => {
    resume = clock.playing;
    clock.play(false);
  });
  scrub.addEventListener("input", () => clock.seek(Number(scrub.value)));
  scrub.addEventListener("pointerup", () => {
    if (resume) clock.play();
    resume = false;
  });
  keys(clock);

  return () => {
    const text = clock.time.toFixed(digits);
    read.textContent = text;
    scrub.value = clock.time;
    scrub.style.setProperty("--done", `${(100 * (clock.time - clock.begin)) / (clock.end - clock.begin || 1)}%`);
    scrub.setAttribute("aria-valuetext", `${text} seconds`);
    play.setAttribute("aria-label", clock.playing ? "Pause" : "Play");
    play.classList.toggle("playing", clock.playing);
  };
}

/** Space plays and pauses, arrows step, Home and End jump; not while something is typed or chosen. */
function keys(clock) {
  const step = STEP * (clock.end - clock.begin);
  const actions = {
    " ": () => clock.play(!clock.playing),
    ArrowLeft: () => clock.seek(clock.time - step),
    ArrowRight: () => clock.seek(clock.time + step),
    Home: () => clock.seek(clock.begin),
    End: () => clock.seek(clock.end),
  };
  document.addEventListener("keydown", (event) => {
    const { target, key } = event;
    const typing = target.matches?.("input:not([type=range]), select, textarea, summary");
    const pressing = key === " " && target.matches?.("button");
    if (typing || pressing || event.ctrlKey || event.metaKey || event.altKey || !actions[key]) return;
    event.preventDefault();
    if (key !== " ") clock.play(false);
    actions[key]();
  });
}
