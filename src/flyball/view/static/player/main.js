// The player: reads a recording, builds the page's parts and keeps them at one time.
import { controlBar } from "./bar.js";
import { Clock } from "./clock.js";
import { readRecording } from "./data.js";
import { motionPoints } from "./framing.js";
import { Mechanism } from "./mechanism.js";
import { axesMark, nameTip, scaleMark } from "./overlay.js";
import { bodyLegend, channelPicker, summary } from "./panels.js";
import { Plots } from "./plots.js";
import { Stage } from "./stage.js";
import { THEMES } from "./theme.js";

const INSET = { top: 58, right: 26, bottom: 56, left: 26 }; // px of the picture kept free of the motion
const GAP = 14; // px between the motion and the legend
const ROOMY = 700; // px of width from which the legend of a few bodies opens by itself
const FEW = 9;
const find = (selector) => document.querySelector(selector);

/** The length that symbols scale with: the recorded one, kept within what the picture can show. */
function symbolUnit(recording) {
  const points = motionPoints({ ...recording, joints: [] }, 0);
  const low = points[0].clone();
  const high = points[0].clone();
  for (const point of points) {
    low.min(point);
    high.max(point);
  }
  const extent = high.distanceTo(low);
  return extent > 0 ? Math.min(Math.max(recording.size, extent / 7), extent / 2) : recording.size;
}

/** What the page's address asks for, as #t=5&theme=dark&view=top&play=1. */
function wishes() {
  const hash = new URLSearchParams(location.hash.slice(1));
  const time = hash.has("t") ? Number(hash.get("t")) : null;
  const theme = Object.hasOwn(THEMES, hash.get("theme")) ? hash.get("theme") : null;
  return { time: Number.isFinite(time) ? time : null, theme, view: hash.get("view"), play: hash.get("play") };
}

/** Switch between the themes; the first one is the address's or the system's. */
function themeSwitch(button, wanted, onChange) {
  const system = matchMedia("(prefers-color-scheme: dark)");
  let chosen = wanted;
  const apply = () => {
    const name = chosen ?? (system.matches ? "dark" : "light");
    document.documentElement.dataset.theme = name;
    onChange(THEMES[name]);
  };
  system.addEventListener("change", apply);
  button.addEventListener("click", () => {
    chosen = document.documentElement.dataset.theme === "dark" ? "light" : "dark";
    apply();
  });
  apply();
}

function message(text) {
  const box = find(".message");
  box.textContent = text;
  box.hidden = false;
}

/** Camera presets; in the plane there is one, which fits the motion into the picture. */
function viewButtons(stage) {
  for (const button of document.querySelectorAll(".views button")) {
    button.hidden = stage.planar ? button.value !== "iso" : false;
    if (stage.planar) button.textContent = "Fit";
    button.addEventListener("click", () => stage.look(button.value, true));
  }
}

function begin(clock, { time, play }) {
  if (time !== null) clock.seek(time);
  const quiet = matchMedia("(prefers-reduced-motion: reduce)").matches || window.parent !== window;
  if (play === "1" || (play === null && time === null && !quiet)) clock.play();
}

function describe(recording) {
  const span = recording.t.at(-1) - recording.t[0];
  const bodies = recording.bodies.length === 1 ? "1 body" : `${recording.bodies.length} bodies`;
  find(".subtitle").textContent = span > 0 ? `${bodies}, ${Number(span.toPrecision(3))} s` : bodies;
  if (!recording.channels.length && !Object.keys(recording.notes).length) document.body.classList.add("alone");
  if (!recording.channels.length) document.body.classList.add("plotless");
}

/** Margins of the picture: the least, the corner that the open legend covers, and ways to keep clear of it. */
function margins() {
  const list = find(".legend ul");
  if (list.hidden) return { least: INSET, covered: null, ways: [] };
  const [stage, box] = [find(".stage"), list].map((part) => part.getBoundingClientRect());
  const covered = { right: box.right - stage.left + GAP, bottom: box.bottom - stage.top + GAP };
  return {
    least: INSET,
    covered,
    ways: [
      { ...INSET, left: covered.right },
      { ...INSET, top: covered.bottom },
    ],
  };
}

/** Everything that shows the mechanism, and what sets it to a time. */
function buildPicture(recording) {
  const unit = symbolUnit(recording);
  const mechanism = new Mechanism(recording, unit);
  const stage = new Stage(find(".stage"), mechanism, motionPoints(recording, unit), margins);
  const redraw = () => (stage.dirty = true);
  if (!stage.renderer) message("No picture: this browser has WebGL switched off. Plots and the time cursor work.");
  find(".stage").addEventListener("stage-lost", () =>
    message("The browser took the picture's WebGL away. Reload the page."),
  );
  const legend = bodyLegend(find(".legend ul"), find(".legend > button"), mechanism.bodies, {
    onShow: (index, on) => redraw(mechanism.show(index, on)),
    onTrail: (index, on) => redraw(mechanism.trail(index, on)),
    onPoint: (index, on) => redraw(mechanism.bodies[index].glow(on)),
  });
  legend.open(innerWidth >= ROOMY && mechanism.bodies.length <= FEW);
  stage.resize();
  nameTip(find(".stage"), find(".tip"), stage, (body, on) => redraw(body.glow(on)));
  viewButtons(stage);
  return { mechanism, stage };
}

/** Draw whenever something has changed, for as long as the page lives. */
function keepDrawing(clock, stage) {
  const turnAxes = axesMark(find(".axes"), stage.planar);
  const showScale = scaleMark(find(".scale"));
  const draw = (now) => {
    clock.tick(now);
    if (stage.draw(now)) {
      stage.camera.updateMatrixWorld();
      turnAxes(stage.camera);
      showScale(stage.scale);
    }
    document.body.dataset.ready ??= "";
    requestAnimationFrame(draw);
  };
  requestAnimationFrame(draw);
}

/** Start the player on the bytes of a recording. */
export function start(buffer) {
  const recording = readRecording(buffer);
  const { t } = recording;
  const wanted = wishes();
  describe(recording);
  const { mechanism, stage } = buildPicture(recording);
  const clock = new Clock(t[0], t.at(-1), () => update());
  const plots = new Plots(find(".plots"), t, (time) => clock.seek(time));
  const refreshBar = controlBar(find(".bar"), clock);
  const update = () => {
    const frame = mechanism.seek(clock.time);
    plots.seek(clock.time, frame);
    refreshBar();
    stage.dirty = true;
  };
  channelPicker(find(".picker"), find(".pick"), recording.channels, recording.shown, (channels, together) =>
    plots.show(channels, together),
  );
  summary(find(".summary"), recording.notes);
  themeSwitch(find(".theme"), wanted.theme, (theme) => {
    mechanism.retheme(theme);
    stage.retheme(theme);
    plots.retheme();
  });
  if (wanted.view && !stage.planar && find(`.views button[value="${CSS.escape(wanted.view)}"]`))
    stage.look(wanted.view);
  document.addEventListener("click", (event) => event.detail && event.target.closest("button")?.blur());
  update();
  begin(clock, wanted);
  window.flyball = hooks(clock, mechanism, stage, recording);
  keepDrawing(clock, stage);
}

/** What a script on the page may ask for; tests do. */
function hooks(clock, mechanism, stage, recording) {
  return {
    seek(time) {
      clock.play(false);
      clock.seek(time);
    },
    play: (on = true) => clock.play(on),
    pose: () => mechanism.pose(),
    time: () => clock.time,
    playing: () => clock.playing,
    bodies: () => recording.bodies.map((body) => body.name),
    look: (view) => stage.look(view),
    webgl: () => Boolean(stage.renderer),
  };
}
