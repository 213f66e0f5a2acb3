// The control bar: play, scrub, speed, loop, and the keys that do the same.
import { element, shortNumber, timeDigits } from "./format.js";
import { SpeedChoice } from "./speeds.js";

const DENSE = 60; // marks that leave little room to point at one
const STEP = 1 / 200; // of the whole span, for the arrow keys

/**
 * Wire the bar to the clock. Returns `refresh`, which brings the bar up to date, `mark`, which shows other marks, and
 * `speeds`, which says speeds in other words.
 */
export function controlBar(bar, clock, keys, marks = []) {
  const part = (name) => bar.querySelector(`[name=${name}]`);
  const [play, scrub, speed, loop] = ["play", "scrub", "speed", "loop"].map(part);
  const read = bar.querySelector("output");
  const total = bar.querySelector(".total");
  const span = () => {
    for (const control of [play, scrub, speed, loop]) control.disabled = clock.still;
    const digits = timeDigits((clock.end - clock.begin) * clock.scale);
    Object.assign(scrub, { min: clock.begin, max: clock.end, step: "any" });
    total.textContent = clock.scale ? ` / ${((clock.end - clock.origin) * clock.scale).toFixed(digits)} s` : "";
    return digits;
  };
  span();
  addMarks(scrub, clock, marks);

  play.addEventListener("click", () => clock.play(!clock.playing));
  part("start").addEventListener("click", () => clock.seek(clock.begin));
  const choice = new SpeedChoice(speed, part("typed-speed"), clock);
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
  barKeys(keys, clock, { choice, loop });

  const refresh = () => {
    const digits = span();
    const text = clock.scale ? ((clock.time - clock.origin) * clock.scale).toFixed(digits) : "–";
    read.textContent = text;
    scrub.value = clock.time;
    scrub.style.setProperty("--done", `${(100 * (clock.time - clock.begin)) / (clock.end - clock.begin || 1)}%`);
    scrub.setAttribute("aria-valuetext", `${text} seconds`);
    play.setAttribute("aria-label", clock.playing ? "Pause" : "Play");
    play.classList.toggle("playing", clock.playing);
  };
  return { refresh, mark: (other) => addMarks(scrub, clock, other), speeds: (words) => choice.describe(words) };
}

/** Ticks above the track where something happened: pointing at one tells what, a click goes there. */
function addMarks(scrub, clock, marks) {
  for (const old of scrub.parentElement.querySelectorAll(".event")) old.remove();
  const inside = clock.still ? [] : marks.filter(({ t }) => t >= clock.begin && t <= clock.end);
  if (!inside.length) return;
  const holder = scrub.closest(".track") ?? element("span", { className: "track" });
  if (!holder.contains(scrub)) {
    scrub.replaceWith(holder);
    holder.append(scrub);
  }
  holder.classList.toggle("dense", inside.length > DENSE);
  for (const { t, text } of inside) {
    const tick = element("button", { type: "button", className: "event", tabIndex: -1, title: `${text}, ${shortNumber(t)} s` });
    tick.style.setProperty("--at", (t - clock.begin) / (clock.end - clock.begin));
    tick.addEventListener("click", () => clock.seek(t));
    holder.append(tick);
  }
}

/** The keys that do the same. */
function barKeys(keys, clock, parts) {
  const step = () => STEP * (clock.end - clock.begin);
  const paused = (action) => () => {
    clock.play(false);
    action();
  };
  keys.add("Space", "play or pause", () => clock.play(!clock.playing));
  keys.add(
    "ArrowLeft",
    "",
    paused(() => clock.seek(clock.time - step())),
  );
  keys.add(
    "ArrowRight",
    "a little back or on",
    paused(() => clock.seek(clock.time + step())),
    "← →",
  );
  keys.add(
    "Home",
    "",
    paused(() => clock.seek(clock.begin)),
  );
  keys.add(
    "End",
    "to the start or the end",
    paused(() => clock.seek(clock.end)),
    "Home End",
  );
  const faster = (by) => () => parts.choice.change(by);
  keys.add("-", "", faster(-1));
  keys.add("+ =", "slower or faster", faster(1), "− +");
  keys.add("l", "play once or again and again", () => parts.loop.click(), "L");
}
