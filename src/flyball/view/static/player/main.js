// The player: reads a recording, builds the page's parts and keeps them at one time.
import { controlBar } from "./bar.js";
import { Clock } from "./clock.js";
import { Compared } from "./compared.js";
import { extendRecording, readRecording } from "./data.js";
import { drawFigures, reportButtons } from "./report.js";
import { motionPoints } from "./framing.js";
import { Modes, periodWords } from "./modes.js";
import { Keys } from "./keys.js";
import { Mechanism } from "./mechanism.js";
import { Names } from "./names.js";
import { axesMark, partTip, scaleMark } from "./overlay.js";
import { bodyCount, bodyLegend, channelPicker, summary } from "./panels.js";
import { Plots } from "./plots.js";
import { Card } from "./select.js";
import { saveButtons } from "./save.js";
import { Shown } from "./shown.js";
import { Stage } from "./stage.js";
import { THEMES } from "./theme.js";

const INSET = { top: 58, right: 26, bottom: 56, left: 26 }; // px of the picture kept free of the motion
const GAP = 14; // px between the motion and the legend
const ROOMY = 700; // px of width from which the legend of a few bodies opens by itself
const FEW = 9;
const RESIZED = 1.25; // change of the typical length from which symbols are drawn at another size
const VIEWS = ["iso", "front", "side", "top"];
const find = (selector) => document.querySelector(selector);

/** The motion's extent, and the length that symbols scale with: the recorded one, kept within what can be seen. */
function measures(recording) {
  const points = motionPoints({ ...recording, joints: [] }, 0);
  const low = points[0].clone();
  const high = points[0].clone();
  for (const point of points) {
    low.min(point);
    high.max(point);
  }
  const extent = high.distanceTo(low);
  const { size } = recording;
  return extent > 0 ? { extent, unit: Math.min(Math.max(size, extent / 7), extent / 2) } : { extent: size, unit: size };
}

/** What the page's address asks for, as #t=5&theme=dark&view=top&play=1&show=reactions,names&select=rod&mode=2. */
function wishes() {
  const hash = new URLSearchParams(location.hash.slice(1));
  const time = hash.has("t") ? Number(hash.get("t")) : null;
  const theme = Object.hasOwn(THEMES, hash.get("theme")) ? hash.get("theme") : null;
  const show = hash.has("show") ? hash.get("show").split(",") : null;
  const named = ["view", "play", "select", "arrows", "mode"].map((name) => hash.get(name));
  const [view, play, select, arrows, mode] = named;
  return {
    time: Number.isFinite(time) ? time : null,
    theme,
    show,
    view,
    play,
    select,
    arrows: Number(arrows) || 1,
    mode,
  };
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

function begin(clock, { time, play }) {
  if (time !== null) clock.seek(time);
  const quiet = matchMedia("(prefers-reduced-motion: reduce)").matches || window.parent !== window;
  if (play === "1" || (play === null && time === null && !quiet)) clock.play();
}

function describe(recording) {
  const span = recording.t.at(-1) - recording.t[0];
  const bodies = bodyCount(recording);
  const { modes } = recording;
  find(".remark").textContent = recording.remark;
  find(".remark").hidden = !recording.remark;
  if (modes.length)
    find(".subtitle").textContent = `${bodies}, ${modes.length === 1 ? "1 mode" : `${modes.length} modes`}`;
  else find(".subtitle").textContent = span > 0 ? `${bodies}, ${Number(span.toPrecision(3))} s` : bodies;
  const alone = !recording.channels.length && !Object.keys(recording.notes).length && !find(".live");
  document.body.classList.toggle("alone", alone);
  document.body.classList.toggle("plotless", !recording.channels.length);
}

/** Margins of the picture: the least, the corner that the open legend covers, and ways to keep clear of it. */
function margins() {
  const list = find(".legend ul");
  const forces = find(".forces");
  const least = forces.hidden ? INSET : { ...INSET, bottom: Math.max(INSET.bottom, forces.offsetHeight + 2 * GAP) };
  if (list.hidden) return { least, covered: null, ways: [] };
  const [stage, box] = [find(".stage"), list].map((part) => part.getBoundingClientRect());
  const covered = { right: box.right - stage.left + GAP, bottom: box.bottom - stage.top + GAP };
  return {
    least,
    covered,
    ways: [
      { ...least, left: covered.right },
      { ...least, top: covered.bottom },
    ],
  };
}

/** The picture, without what steers it. */
function buildPicture(recording, { unit, extent }) {
  const mechanism = new Mechanism(recording, unit, extent);
  const every = [recording, ...(recording.compared?.others ?? []).map((other) => other.recording)];
  const points = every.flatMap((one) => motionPoints(one, unit));
  const stage = new Stage(find(".stage"), mechanism, points, margins);
  if (!stage.renderer) message("No picture: this browser has WebGL switched off. Plots and the time cursor work.");
  find(".stage").addEventListener("stage-lost", () =>
    message("The browser took the picture's WebGL away. Reload the page."),
  );
  return { mechanism, stage, names: new Names(find(".names"), mechanism) };
}

/** One part is selected, or none: it glows, its card is open, the camera may go along. */
function selection(picture, card, legend, follow, frame) {
  const { stage } = picture;
  const state = { part: null };
  const glow = (name, on) => {
    for (const part of picture.mechanism.parts(name)) part.glow(on || part.name === state.part?.name);
    stage.dirty = true;
  };
  const select = (part) => {
    const before = state.part;
    state.part = part;
    if (before) glow(before.name, false);
    if (part) glow(part.name, true);
    card.show(part, frame());
    legend().mark(part?.name);
    follow.disabled = part?.category !== "body";
    if (stage.followed && follow.disabled) toggleFollow(false);
  };
  const toggleFollow = (on = !stage.followed) => {
    stage.follow(on && state.part?.category === "body" ? state.part : null);
    follow.setAttribute("aria-pressed", String(Boolean(stage.followed)));
  };
  follow.addEventListener("click", () => toggleFollow());
  /** The same part of another mechanism. */
  const reselect = (part) => {
    const followed = Boolean(stage.followed);
    state.part = null;
    select(part);
    if (followed) toggleFollow(Boolean(part));
  };
  return { state, glow, select, reselect, toggleFollow };
}

/** A click without a drag selects what lies under it. */
function clicks(stage, onPick) {
  const canvas = stage.element.querySelector("canvas");
  let from = null;
  canvas.addEventListener(
    "pointerdown",
    ({ clientX, clientY, button }) => (from = button === 0 ? [clientX, clientY] : null),
  );
  canvas.addEventListener("pointerup", ({ clientX, clientY }) => {
    if (!from || Math.hypot(clientX - from[0], clientY - from[1]) > 4) return;
    const { left, top } = stage.element.getBoundingClientRect();
    onPick(stage.pick(clientX - left, clientY - top));
  });
}

/** Camera presets; in the plane there is one, which fits the motion into the picture. */
function viewButtons(stage, keys, chosen) {
  const go = (view) => {
    chosen.toggleFollow(false);
    stage.look(stage.planar ? "iso" : view, true);
  };
  for (const button of document.querySelectorAll(".views [value]")) {
    button.hidden = stage.planar && button.value !== "fit";
    button.addEventListener("click", () => go(button.value));
  }
  if (!stage.planar)
    VIEWS.forEach((view, k) =>
      keys.add(String(k + 1), k ? "" : "views: isometric, front, side, top", () => go(view), "1 2 3 4"),
    );
  keys.add("0", "fit the motion into the picture", () => go("fit"));
}

function menu(button, panel) {
  const open = (on) => {
    panel.hidden = !on;
    button.setAttribute("aria-expanded", String(on));
  };
  button.addEventListener("click", () => open(panel.hidden));
  document.addEventListener(
    "pointerdown",
    ({ target }) => !panel.contains(target) && !button.contains(target) && open(false),
  );
  panel.addEventListener("keydown", ({ key }) => key === "Escape" && (open(false), button.focus()));
}

/** The keys that switch things on and off. */
function pictureKeys(keys, shown, chosen, theme) {
  keys.add("f", "let the camera follow the selected body", () => chosen.toggleFollow(), "F");
  keys.add("r", "joint reactions", () => shown.toggle("reactions"), "R");
  keys.add("e", "forces of springs, motors and drivers", () => shown.toggle("elements"), "E");
  keys.add("[ ,", "", () => shown.scale(Math.max(shown.targets.mechanism.arrows.factor / 1.5, 0.1)));
  keys.add(
    "] .",
    "shorter or longer arrows",
    () => shown.scale(Math.min(shown.targets.mechanism.arrows.factor * 1.5, 10)),
    "[ ]",
  );
  keys.add("a", "axes of joints and frames", () => shown.toggle("frames"), "A");
  keys.add("b", "axes of bodies", () => shown.toggle("bodies"), "B");
  keys.add("n", "names", () => shown.toggle("names"), "N");
  keys.add("g", "grid", () => shown.toggle("grid"), "G");
  keys.add("d", "light or dark", () => theme.click(), "D");
  keys.add("Escape", "select nothing", () => chosen.select(null), "Esc");
}

/** Draw whenever something has changed, for as long as the page lives. */
function keepDrawing(clock, picture) {
  const { stage } = picture;
  const turnAxes = axesMark(find(".axes"), stage.planar);
  const showScale = scaleMark(find(".scale"));
  const draw = (now) => {
    clock.tick(now);
    const drawn = stage.draw(now);
    if (drawn) {
      stage.camera.updateMatrixWorld();
      turnAxes(stage.camera);
      showScale(stage.scale);
      picture.names.update(stage.camera, stage.size);
    }
    picture.onFrame?.(drawn);
    document.body.dataset.ready ??= "";
    requestAnimationFrame(draw);
  };
  requestAnimationFrame(draw);
}

/** The legend of bodies, the card, and what selects. */
function choosing(picture, recording, plots, now) {
  const { stage } = picture;
  const card = new Card(find(".card"), recording, {
    onClose: () => chosen.select(null),
    onPlot: (channel) => plots.picker.toggle(channel),
    isPlotted: (channel) => plots.picker.has(channel),
  });
  let legend = null;
  const chosen = selection(picture, card, () => legend, find(".follow"), now);
  const list = () => (legend = legendOf(picture, chosen));
  list();
  const { bodies, crowds, trails } = picture.mechanism;
  legend.open(innerWidth >= ROOMY && bodies.length + crowds.length + trails.length <= FEW);
  stage.resize();
  partTip(find(".stage"), find(".tip"), stage, (part, on) => chosen.glow(part.name, on));
  clicks(stage, chosen.select);
  return { card, chosen, list };
}

/** The legend of the mechanism in the picture. */
function legendOf(picture, chosen) {
  const { stage } = picture;
  const redraw = () => (stage.dirty = true);
  return bodyLegend(find(".legend ul"), find(".legend > button"), picture.mechanism, {
    onShow: (index, on) => redraw(picture.mechanism.show(index, on)),
    onTrail: (index, on) => redraw(picture.mechanism.trace(index, on)),
    onSet: (index, on) => redraw(picture.mechanism.crowds[index].show(on)),
    onPath: (index, on) => redraw(picture.mechanism.showPath(index, on)),
    onPoint: (index, on) => chosen.glow(picture.mechanism.bodies[index].name, on),
    onSelect: (index) => chosen.select(picture.mechanism.bodies[index]),
  });
}

/** The list of modes where a recording has some; the bar then speaks of periods. */
function modeList(recording, clock, keys, bar, onSwing) {
  const { modes } = recording;
  if (!modes.length) return null;
  bar.speeds(periodWords(modes[0].end - modes[0].begin));
  return new Modes(find(".modes"), recording, clock, keys, onSwing);
}

/** Start the player on the bytes of a recording. */
export function start(buffer) {
  return new Player(readRecording(buffer));
}

export class Player {
  /** The page with a recording; `replace` shows another one of the same mechanism. */
  constructor(recording) {
    const { t } = recording;
    const wanted = wishes();
    this.recording = recording;
    describe(recording);
    this.measures = measures(recording);
    const picture = (this.picture = buildPicture(recording, this.measures));
    const { stage } = picture;
    const clock = (this.clock = new Clock(t[0], t.at(-1), () => this.update()));
    clock.speed = recording.speed;
    const seek = (time) => clock.seek(time);
    const { compared } = recording;
    const plots = (this.plots = new Plots(find(".plots"), t, seek, recording.marks, compared?.measured ?? []));
    this.figures = drawFigures(recording, seek);
    const keys = new Keys(find(".player"), find(".help"), !find(".report"));
    this.bar = controlBar(find(".bar"), clock, keys, recording.marks);
    if (compared?.others.length) find(".picker [name=together]").checked = false; // the curves of each name in one plot
    plots.picker = channelPicker(
      find(".picker"),
      find(".pick"),
      recording.channels,
      recording.shown,
      (channels, together) => {
        plots.show(channels, together);
        this.compared?.show(new Set(channels.map(({ name }) => name)));
      },
    );
    this.modes = modeList(recording, clock, keys, this.bar, () => this.update());
    Object.assign(this, choosing(picture, recording, plots, () => picture.mechanism.arrows.frame));
    this.shown = new Shown(find(".menu"), find(".forces"), picture, () => (stage.dirty = true));
    this.#switchOn(wanted.show ?? recording.show);
    this.shown.scale(wanted.arrows);
    stage.resize(); // the legend of forces takes room
    find(".compared").hidden = !compared;
    summary(find(".summary"), recording.notes);
    themeSwitch(find(".theme"), wanted.theme, (theme) => this.#retheme(theme));
    this.#prepareControls(keys, wanted);
    this.modes?.open(wanted.mode);
    if (compared) this.#compare(compared);
    this.update();
    begin(clock, wanted);
    if (wanted.select) this.chosen.select(picture.mechanism.parts(wanted.select)[0] ?? null);
    window.flyball = hooks(this);
    keepDrawing(clock, picture);
  }

  #compare(compared) {
    this.compared = new Compared(this, compared, find);
    this.compared.variants.changed();
    this.compared.show(new Set(this.plots.asked[0].map(({ name }) => name)));
  }

  #switchOn(names) {
    for (const name of names) this.shown.set(name, true);
    this.picture.stage.grid.visible = Boolean(this.shown.state.grid);
  }

  #retheme(theme) {
    this.theme = theme;
    const { mechanism, stage } = this.picture;
    for (const part of [mechanism, stage, this.plots, ...this.figures]) part.retheme(theme);
  }

  #prepareControls(keys, wanted) {
    const { stage } = this.picture;
    menu(find(".show"), find(".menu"));
    viewButtons(stage, keys, this.chosen);
    pictureKeys(keys, this.shown, this.chosen, find(".theme"));
    find(".ask").addEventListener("click", () => keys.help());
    reportButtons(stage);
    saveButtons(find(".menu"), this);
    if (VIEWS.includes(wanted.view) && !stage.planar) stage.look(wanted.view);
    document.addEventListener("click", (event) => event.detail && event.target.closest("button")?.blur());
  }

  /** Bring everything to the time of the clock. */
  update() {
    const { picture, clock } = this;
    const frame = picture.mechanism.seek(clock.time);
    for (const panel of [this.plots, ...this.figures]) panel.seek(clock.time, frame);
    this.card.seek(frame);
    this.bar.refresh();
    picture.stage.dirty = true;
    this.compared?.seek(clock.time);
    this.onUpdate?.(clock.time);
  }

  /** Show another recording of the mechanism; camera, choices and switches stay, and the time as far as it can. */
  replace(recording) {
    const { picture, clock, shown } = this;
    const before = picture.mechanism;
    this.recording = recording;
    describe(recording);
    const now = measures(recording);
    if (Math.max(now.unit / this.measures.unit, this.measures.unit / now.unit) > RESIZED) this.measures = now;
    const mechanism = new Mechanism(recording, this.measures.unit, this.measures.extent);
    picture.mechanism = mechanism;
    picture.stage.replace(mechanism, () => motionPoints(recording, this.measures.unit));
    picture.names = new Names(find(".names"), mechanism);
    mechanism.retheme(this.theme);
    const names = (m) => [...m.bodies, ...m.crowds, ...m.trails].map(({ name }) => name).join("\n");
    if (names(before) === names(mechanism)) mechanism.showAs(before);
    else this.list();
    const on = Object.keys(shown.state).filter((name) => shown.state[name]);
    shown.build();
    this.#switchOn(on);
    shown.scale(shown.factor);
    clock.restrict(recording.t[0], recording.t.at(-1));
    this.bar.mark(recording.marks);
    this.plots.replace(recording.t, recording.marks, this.plots.picker.replace(recording.channels, recording.shown));
    this.card.recording = recording;
    const part = this.chosen.state.part && mechanism.parts(this.chosen.state.part.name)[0];
    this.chosen.reselect(part ?? null);
    summary(find(".summary"), recording.notes, false);
    this.update();
  }

  /** Put other times in place of the recorded ones, or after them; the clock goes to the last one. */
  extend(chunk, restart) {
    const { recording, picture, clock, plots } = this;
    extendRecording(recording, chunk, restart);
    picture.mechanism.extended();
    Object.assign(picture.stage, { points: null, findPoints: () => motionPoints(recording, this.measures.unit) });
    if (restart) this.bar.mark([]);
    plots.extend(recording.t);
    clock.play(false);
    clock.restrict(recording.t[0], recording.t.at(-1), recording.t.at(-1));
  }
}

/** What a script on the page may ask for; tests do. */
function hooks(player) {
  const { clock, picture, shown, chosen, modes } = player;
  const { stage } = picture;
  return {
    mode: () => modes?.name ?? null,
    begin: () => clock.begin,
    seek(time) {
      clock.play(false);
      clock.seek(time);
    },
    play: (on = true) => clock.play(on),
    pose: () => picture.mechanism.pose(),
    poses: (set) => picture.mechanism.crowds.find(({ name }) => name === set)?.poses() ?? [],
    contacts: () => picture.mechanism.arrows.touches?.list(picture.mechanism.arrows.frame) ?? [],
    drawn: () => stage.drawn,
    /** Milliseconds of script for one frame, the picture's commands included, over `n` frames through the motion. */
    effort(n = 60) {
      const [from, to] = [player.recording.t[0], player.recording.t.at(-1)];
      const start = performance.now();
      for (let k = 0; k < n; k++) picture.mechanism.seek(from + ((to - from) * k) / n);
      const moved = performance.now();
      for (let k = 0; k < n; k++) {
        stage.dirty = true;
        stage.draw(performance.now());
      }
      return { moving: (moved - start) / n, drawing: (performance.now() - moved) / n };
    },
    time: () => clock.time,
    playing: () => clock.playing,
    bodies: () => player.recording.bodies.map((body) => body.name),
    pick: (x, y) => stage.pick(x, y)?.name ?? null,
    look: (view) => stage.look(view),
    webgl: () => Boolean(stage.renderer),
    show: (name, on = true) => shown.set(name, on),
    shown: () => Object.keys(shown.state).filter((name) => shown.state[name]),
    arrows: () => picture.mechanism.arrows.list(),
    axes: () => picture.mechanism.triads.list(),
    select: (name) => chosen.select(picture.mechanism.parts(name)[0] ?? null),
    selected: () => chosen.state.part?.name ?? null,
    paths: () =>
      picture.mechanism.trails.map(({ name, trail }) => ({ name, points: trail?.points.map((p) => p.toArray()) ?? [] })),
    camera: () => ({ position: stage.camera.position.toArray(), target: stage.controls.target.toArray() }),
    ghosts: () =>
      (player.compared?.variants.kept ?? []).map(({ label, colour, hidden, mechanism }) => ({ label, colour, hidden, pose: mechanism.pose() })),
    slack: () => picture.mechanism.lines.filter(({ state }) => state?.slack).map(({ name }) => name),
    /** Where something on a body is in the picture [px]. */
    pixel(body, position = [0, 0, 0]) {
      const p = stage.camera.position.clone();
      picture.mechanism.place({ body, position }, p).project(stage.camera);
      const [width, height] = stage.size;
      return [((p.x + 1) * width) / 2, ((1 - p.y) * height) / 2];
    },
  };
}
