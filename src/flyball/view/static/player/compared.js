// What a motion is compared with: other motions as ghosts with a legend, measured values, and tables of differences.
import { element } from "./format.js";
import { CURVES } from "./theme.js";
import { Variants } from "./variants.js";

const MOTION = "motion"; // head of a column of labels, see comparison_tables.py

function swatchOf(colour) {
  const swatch = element("span", { className: "swatch" });
  swatch.style.background = colour;
  return swatch;
}

/** A head of a column; the label of a motion gets its colour. */
function head(text, colours) {
  const mark = colours.has(text) ? [swatchOf(colours.get(text)), " "] : [];
  return element("th", {}, ...mark, text);
}

/** A cell; the label of a motion is shown by its colour. */
function cell(text, column, colours) {
  if (column !== MOTION) return element("td", { textContent: text.replace(/^-/, "−") });
  return element("td", { title: text, aria: { label: text } }, swatchOf(colours.get(text)));
}

/** One table, and for each row the curve that it belongs to. */
function tableOf({ title, columns, rows, note, curves }, colours) {
  const heads = element("tr", {}, ...columns.map((text) => head(text, colours)));
  const lines = rows.map((texts) => element("tr", {}, ...texts.map((text, k) => cell(text, columns[k], colours))));
  const table = element("table", {}, element("thead", {}, heads), element("tbody", {}, ...lines));
  if (curves.length) table.className = "figures";
  const box = element("div", { className: "scrolled" }, table);
  const node = element("section", {}, element("h3", { textContent: title }), box);
  if (note) node.append(element("p", { textContent: note }));
  return { node, lines, curves };
}

export class Compared {
  /** The comparison of a player's recording; `find` finds the places on the page. */
  constructor(player, compared, find) {
    const list = find(".compared ul");
    this.variants = new Variants(player, list);
    const colours = new Map([[compared.label, CURVES[0]]]);
    const entry = (mark, label) => {
      const name = element("span", { className: "name", textContent: label, title: label });
      list.append(element("li", {}, mark, name));
    };
    if (compared.others.length) entry(swatchOf(CURVES[0]), compared.label);
    for (const { label, recording } of compared.others) colours.set(label, this.variants.give(label, recording));
    if (compared.measured.length) entry(element("span", { className: "dot" }), `measured: ${compared.source}`);
    this.tables = compared.tables.map((table) => tableOf(table, colours));
    const box = find(".differences");
    box.hidden = !this.tables.length;
    box.append(...this.tables.map(({ node }) => node));
  }

  /** Show the rows of these curves only. */
  show(names) {
    for (const { node, lines, curves } of this.tables) {
      if (!curves.length) continue;
      lines.forEach((line, k) => (line.hidden = !names.has(curves[k])));
      node.hidden = lines.every((line) => line.hidden);
    }
  }

  seek(time) {
    this.variants.seek(time);
  }
}
