// The panels around the picture: channels to choose from, bodies, and the summary.
import { element } from "./format.js";

const MOST = 300; // channels listed at once

/** The list of channels: search, tick, and whether those of one unit share a plot. */
export function channelPicker(panel, button, channels, shown, onChange) {
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
      element("span", { className: "unit", textContent: channel.unit }),
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
    list.replaceChildren(...found.slice(0, MOST).map(choice));
    if (note) list.append(element("p", { className: "empty", textContent: note }));
  };
  const open = (on) => {
    panel.hidden = !on;
    button.setAttribute("aria-expanded", String(on));
    if (on) {
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
}

/** The legend: a row for each body, to hide it or to show its path. */
export function bodyLegend(box, toggle, bodies, { onShow, onTrail, onPoint }) {
  const rows = bodies.map(({ name, colour }, index) => {
    const swatch = element("span", { className: "swatch" });
    swatch.style.background = colour;
    const row = { shown: true, trail: false };
    const show = element(
      "button",
      { type: "button", className: "body", title: `Hide or show ${name}`, aria: { pressed: "true" } },
      swatch,
      element("span", { className: "name", textContent: name }),
    );
    const trail = element("button", {
      type: "button",
      className: "trail",
      title: `Path of the origin of ${name}`,
      textContent: "path",
      aria: { pressed: "false" },
    });
    show.addEventListener("click", () => {
      row.shown = !row.shown;
      show.setAttribute("aria-pressed", String(row.shown));
      onShow(index, row.shown);
    });
    trail.addEventListener("click", () => {
      row.trail = !row.trail;
      trail.setAttribute("aria-pressed", String(row.trail));
      onTrail(index, row.trail);
    });
    const item = element("li", {}, show, trail);
    item.addEventListener("pointerenter", () => onPoint(index, true));
    item.addEventListener("pointerleave", () => onPoint(index, false));
    return item;
  });
  box.append(...rows);
  toggle.querySelector("span").textContent = bodies.length === 1 ? "1 body" : `${bodies.length} bodies`;
  const open = (on) => {
    box.hidden = !on;
    toggle.setAttribute("aria-expanded", String(on));
  };
  toggle.addEventListener("click", () => open(box.hidden));
  return { open };
}

/** The summary notes as a list of terms. */
export function summary(details, notes) {
  const entries = Object.entries(notes);
  details.hidden = !entries.length;
  details
    .querySelector("dl")
    .append(
      ...entries.map(([term, text]) =>
        element("div", {}, element("dt", { textContent: term }), element("dd", { textContent: text })),
      ),
    );
}
