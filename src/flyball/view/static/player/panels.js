// The panels around the picture: channels to choose from, bodies, and the summary.
import { element, pretty } from "./format.js";

const MOST = 300; // channels listed at once
const FEW = 40; // rows up to which groups are open
const ENOUGH = 600; // px: in a lower panel the summary is closed, for the plots

/** Rows by the groups of their names, which precede the last ``depth`` words; the rows of a group can be folded. */
function grouped(rows, names, depth, open, wrap) {
  const groups = new Map();
  names.forEach((name, k) => {
    const group = name.split(".").slice(0, -depth).join(".");
    groups.set(group, [...(groups.get(group) ?? []), rows[k]]);
  });
  const alone = groups.get("") ?? [];
  groups.delete("");
  const fold = ([group, inner]) =>
    element("details", { className: "group", open }, element("summary", { textContent: group }), wrap(inner));
  return [...alone, ...[...groups].map(fold)];
}

/** The list of channels: search, tick, and whether those of one unit share a plot. */
export function channelPicker(panel, button, known, shown, onChange) {
  let channels = known;
  const chosen = new Set(channels.filter((channel) => shown.includes(channel.name)));
  const search = panel.querySelector("input[type=search]");
  const together = panel.querySelector("input[name=together]");
  const list = panel.querySelector(".choices");
  const report = () =>
    onChange(
      channels.filter((channel) => chosen.has(channel)),
      together.checked,
    );

  const choice = (channel) => {
    const box = element("input", { type: "checkbox", checked: chosen.has(channel) });
    box.addEventListener("change", () => {
      if (box.checked) chosen.add(channel);
      else chosen.delete(channel);
      report();
    });
    const name = element("span", { className: "name", textContent: channel.name });
    return element(
      "label",
      { className: "choice" },
      box,
      name,
      element("span", { className: "unit", textContent: pretty(channel.unit) }),
    );
  };
  const fill = () => {
    const words = search.value.toLowerCase().split(/\s+/).filter(Boolean);
    const found = channels.filter(({ name, unit }) =>
      words.every((word) => `${name} ${unit}`.toLowerCase().includes(word)),
    );
    const note =
      found.length > MOST
        ? `${found.length - MOST} more: narrow the search`
        : found.length
          ? ""
          : "No channel of that name";
    const listed = found.slice(0, MOST);
    const names = listed.map(({ name }) => name);
    const wrap = (rows) => element("div", {}, ...rows);
    list.replaceChildren(...grouped(listed.map(choice), names, 2, words.length > 0 || found.length <= FEW, wrap));
    if (note) list.append(element("p", { className: "empty", textContent: note }));
  };
  const open = (on) => {
    panel.hidden = !on;
    button.setAttribute("aria-expanded", String(on));
    if (on) {
      panel.style.setProperty("--under", `${button.offsetTop + button.offsetHeight + 6}px`);
      fill();
      search.focus();
    }
  };
  search.addEventListener("input", fill);
  together.addEventListener("change", report);
  button.addEventListener("click", () => open(panel.hidden));
  panel.querySelector(".clear").addEventListener("click", () => {
    chosen.clear();
    fill();
    report();
  });
  document.addEventListener(
    "pointerdown",
    ({ target }) => !panel.hidden && !panel.contains(target) && !button.contains(target) && open(false),
  );
  panel.addEventListener("keydown", (event) => {
    if (event.key !== "Escape") return;
    open(false);
    button.focus();
  });
  report();
  return {
    has: (channel) => chosen.has(channel),
    /** Offer other channels; those of the same names are chosen. Returns the chosen ones, and whether they share plots. */
    replace(others, usual) {
      const names = new Set([...chosen].map(({ name }) => name));
      channels = others;
      chosen.clear();
      for (const channel of channels) if (names.has(channel.name)) chosen.add(channel);
      if (names.size && !chosen.size) for (const channel of channels) if (usual.includes(channel.name)) chosen.add(channel);
      if (!panel.hidden) fill();
      return [channels.filter((channel) => chosen.has(channel)), together.checked];
    },
    toggle(channel) {
      if (!chosen.delete(channel)) chosen.add(channel);
      if (!panel.hidden) fill();
      report();
    },
  };
}

const EYE = "M1.500 8S4 3.500 8 3.500 14.500 8 14.500 8 12 12.500 8 12.500 1.500 8 1.500 8z";

/** An eye, as a picture. */
function eye() {
  const svg = document.createElementNS("http://www.w3.org/2000/svg", "svg");
  svg.setAttribute("viewBox", "0 0 16 16");
  svg.setAttribute("aria-hidden", "true");
  svg.innerHTML = `<path d="${EYE}"/><circle cx="8" cy="8" r="2" class="full"/>`;
  return svg;
}

function switchButton(className, title, on, onClick, ...children) {
  const button = element(
    "button",
    { type: "button", className, title, aria: { pressed: String(on), label: title } },
    ...children,
  );
  button.addEventListener("click", () => {
    const pressed = button.getAttribute("aria-pressed") !== "true";
    button.setAttribute("aria-pressed", String(pressed));
    onClick(pressed);
  });
  return button;
}

const BODILY = ["gear", "rack", "wheel", "ball"]; // symbols that are the body itself

/** How many bodies there are, in words. */
export function bodyCount({ bodies, sets }) {
  const count = sets.reduce((sum, set) => sum + set.count, bodies.length);
  return count === 1 ? "1 body" : `${count} bodies`;
}

/** The legend: a row for each body, to select it, to hide it, or to show its path; then the paths asked for. */
export function bodyLegend(
  box,
  toggle,
  { bodies, joints, trails, crowds },
  { onShow, onTrail, onPoint, onSelect, onPath, onSet },
) {
  const swatch = (colour, className = "swatch") => {
    const mark = element("span", { className });
    mark.style.background = colour;
    return mark;
  };
  const worn = new Set(joints.filter(({ data }) => BODILY.includes(data.kind)).map(({ data }) => data.body));
  const rows = bodies.map(({ name, colour, data }, index) => {
    const text = element("span", { className: "name", textContent: name });
    const select = element(
      "button",
      { type: "button", className: "body", title: `Select ${name}` },
      swatch(colour),
      text,
    );
    select.addEventListener("click", () => onSelect(index));
    const trail = switchButton("trail", `Path of the origin of ${name}`, false, (on) => onTrail(index, on), "path");
    const item = element("li", {}, select, trail);
    const show = switchButton(
      "eye",
      `Show ${name}`,
      true,
      (on) => {
        item.classList.toggle("off", !on);
        onShow(index, on);
      },
      eye(),
    );
    item.append(show);
    item.hidden = !data.shapes.length && !worn.has(name); // a legend of what is seen
    item.addEventListener("pointerenter", () => onPoint(index, true));
    item.addEventListener("pointerleave", () => onPoint(index, false));
    return item;
  });
  const paths = trails.map(({ name, colour }, index) => {
    const text = element("span", { className: "name", textContent: name });
    const label = element("span", { className: "body" }, swatch(colour, "swatch line"), text);
    return element(
      "li",
      {},
      label,
      switchButton("eye", `Show the path ${name}`, true, (on) => onPath(index, on), eye()),
    );
  });
  const sets = crowds.map(({ name, colour, count }, index) => {
    const text = element("span", { className: "name", textContent: `${name} (${count})` });
    const label = element("span", { className: "body" }, swatch(colour), text);
    return element(
      "li",
      {},
      label,
      switchButton("eye", `Show ${name}`, true, (on) => onSet(index, on), eye()),
    );
  });
  const names = bodies.map(({ name }) => name);
  const wrap = (inner) => element("ul", {}, ...inner);
  const listed = grouped(rows, names, 1, rows.length <= FEW, wrap);
  const items = listed.map((row) => (row.tagName === "LI" ? row : element("li", { className: "folded" }, row)));
  box.replaceChildren(...items, ...sets, ...paths);
  toggle.querySelector("span").textContent = bodyCount({ bodies, sets: crowds });
  const open = (on) => {
    box.hidden = !on;
    toggle.setAttribute("aria-expanded", String(on));
  };
  toggle.onclick = () => open(box.hidden);
  return { open, mark: (name) => rows.forEach((row, k) => row.classList.toggle("selected", bodies[k].name === name)) };
}

const unbroken = (text) => text.replace(/(\d)e-(\d)/g, "$1e\u2011$2"); // a number stays on one line

/** The summary notes as a list of terms. */
export function summary(details, notes, first = true) {
  const entries = Object.entries(notes);
  details.hidden = !entries.length;
  const taken = Boolean(document.querySelector(".live, .compared:not([hidden])")); // the room for the summary
  if (first)
    details.open =
      !taken && (details.parentElement.clientHeight >= ENOUGH || document.body.matches(".plotless:not(.has-modes)"));
  details
    .querySelector("dl")
    .replaceChildren(
      ...entries.map(([term, text]) =>
        element("div", {}, element("dt", { textContent: term }), element("dd", { textContent: unbroken(text) })),
      ),
    );
}
