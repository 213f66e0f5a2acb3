// Colours: of bodies, of symbols, and of the two themes.
import * as THREE from "three";

// Neighbours differ in lightness as well as in hue, so that they stay apart for colour-blind eyes and in grey print.
const PALETTE = [
  "#2f6fb7",
  "#e58a2b",
  "#2a9d83",
  "#c8465a",
  "#7d63b8",
  "#d9b02c",
  "#58b0d8",
  "#a2572f",
  "#d983b4",
  "#6f8f2f",
  "#5b6b7c",
  "#93a8d9",
];
// A ramp of steady lightness change, for chains of many alike bodies.
const RAMP = ["#3a57b5", "#2569a5", "#1f8f9f", "#3fae82", "#94bf55", "#e3b93c", "#ec8b45", "#d85a5a", "#a63d72"];
export const CURVES = ["#2f7fd1", "#e5862b", "#2aa187", "#d14d62", "#8a6fd0", "#c9a11f", "#4fb0d8", "#b0673f"];
export const GROUND = "#8b96a3";

export const THEMES = {
  light: {
    ink: "#1d2733",
    rim: "#1d2733",
    metal: "#6f7c8b",
    paper: "#ffffff",
    steel: "#9aa6b3",
    pin: "#ffffff",
    hatch: "#5c6875",
    tube: "#4a5767",
    grid: "#7f8fa3",
    gridStrength: 0.34,
    reaction: "#7a3fc4",
    element: "#0d8a7a",
    load: "#d3233f",
    stick: "#1a8f5a",
    slip: "#e0701a",
    axisX: "#d0384c",
    axisY: "#2b8a4b",
    axisZ: "#2f6fd0",
    accent: "#1f6feb",
    rope: "#6b563f",
    shadow: 0.26,
    flatShadow: 0.13,
  },
  dark: {
    ink: "#eef3f8",
    rim: "#0a0e13",
    metal: "#98a4b2",
    paper: "#151a21",
    steel: "#aeb9c5",
    pin: "#1b222b",
    hatch: "#93a0ae",
    tube: "#5b6878",
    grid: "#8fa3ba",
    gridStrength: 0.26,
    reaction: "#b48bff",
    element: "#35c9b4",
    load: "#ff5f76",
    stick: "#3fd08a",
    slip: "#ffa348",
    axisX: "#ff7083",
    axisY: "#5cc98a",
    axisZ: "#79aaff",
    accent: "#5a9cff",
    rope: "#cbb79b",
    shadow: 0.5,
    flatShadow: 0.35,
  },
};

function ramp(fraction) {
  const place = fraction * (RAMP.length - 1);
  const k = Math.min(Math.floor(place), RAMP.length - 2);
  return `#${new THREE.Color(RAMP[k]).lerp(new THREE.Color(RAMP[k + 1]), place - k).getHexString()}`;
}

/** One colour for each body: its own where the browser knows it, else from the palette, else from the ramp. */
export function bodyColours(bodies) {
  const moving = bodies.filter((body) => body.name !== "ground");
  return bodies.map((body) => {
    if (body.color && CSS.supports("color", body.color)) return hexOf(body.color);
    if (body.name === "ground") return GROUND;
    const k = moving.indexOf(body);
    return moving.length <= PALETTE.length ? PALETTE[k] : ramp(k / (moving.length - 1));
  });
}

/** Any colour the browser understands, as #rrggbb. */
function hexOf(colour) {
  const pen = document.createElement("canvas").getContext("2d");
  pen.fillStyle = colour;
  return pen.fillStyle.startsWith("#") ? pen.fillStyle : "#8b96a3";
}

const DARK = 0.08; // luminance of a colour that hardly differs from a dark ground

/** Whether a colour hardly differs from the ground of a theme. */
export function sinks(colour, theme) {
  const { r, g, b } = new THREE.Color(colour);
  return theme === THEMES.dark && 0.2126 * r + 0.7152 * g + 0.0722 * b < DARK;
}

/** The line around a flat body: its own colour, far towards ink. */
export function outlineColour(colour, theme = THEMES.light) {
  if (sinks(colour, theme)) return new THREE.Color(theme.steel);
  return new THREE.Color(colour).lerp(new THREE.Color(theme === THEMES.dark ? "#000000" : theme.ink), 0.72);
}
