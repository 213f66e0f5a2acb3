// Numbers for people.

const PREFIXES = [
  [1e3, "km"],
  [1, "m"],
  [1e-3, "mm"],
  [1e-6, "µm"],
];

/** Four digits, with a power of ten only where it is needed. */
export function shortNumber(value) {
  if (value === null || value === undefined || !Number.isFinite(value)) return "–";
  const size = Math.abs(value);
  if (size === 0) return "0";
  const text = size >= 1e5 || size < 1e-3 ? value.toExponential(2) : String(Number(value.toPrecision(4)));
  return text.replace("e+", "e").replaceAll("-", "−");
}

/** A length in the unit that suits it. */
export function lengthText(metres) {
  const [factor, unit] = PREFIXES.find(([size]) => metres >= size * 0.9999) ?? PREFIXES.at(-1);
  return `${Number((metres / factor).toPrecision(3))} ${unit}`;
}

/** Digits after the point that show a time on a given span. */
export function timeDigits(span) {
  return span > 0 ? Math.min(Math.max(3 - Math.ceil(Math.log10(span)), 1), 9) : 1;
}

/** An element with properties and children; text goes in as text, never as markup. */
export function element(tag, properties = {}, ...children) {
  const { aria = {}, ...rest } = properties;
  const node = Object.assign(document.createElement(tag), rest);
  for (const [name, value] of Object.entries(aria)) node.setAttribute(name === "role" ? name : `aria-${name}`, value);
  node.append(...children);
  return node;
}

const PRETTY = { "N*m": "N m", "m/s^2": "m/s²", "rad/s^2": "rad/s²", 1: "" };

/** A unit as people write it. */
export function pretty(unit) {
  return Object.hasOwn(PRETTY, unit) ? PRETTY[unit] : unit;
}
