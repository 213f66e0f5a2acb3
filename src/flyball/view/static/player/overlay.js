// What lies over the picture: axes, scale, the name under the pointer, messages.
import * as THREE from "three";
import { lengthText } from "./format.js";

const ARM = 24; // px
const AXES = ["x", "y", "z"];

/** The little axes in the corner; returns the function that turns them with the camera. */
export function axesMark(svg, planar) {
  const shown = planar ? AXES.slice(0, 2) : AXES;
  const arms = shown.map((axis) => svg.querySelector(`.axis-${axis}`));
  for (const arm of arms) arm.removeAttribute("display");
  const vector = new THREE.Vector3();
  return (camera) => {
    const turned = arms.map((arm, k) => {
      vector.set(0, 0, 0).setComponent(k, 1).transformDirection(camera.matrixWorldInverse);
      const [x, y] = [ARM * vector.x, -ARM * vector.y];
      arm.querySelector("line").setAttribute("x2", x);
      arm.querySelector("line").setAttribute("y2", y);
      const label = arm.querySelector("text");
      const short = Math.hypot(x, y) < 0.25 * ARM;
      label.setAttribute("x", short ? 9 : x * 1.35);
      label.setAttribute("y", (short ? -9 : y * 1.35) + 4);
      return { arm, depth: vector.z };
    });
    turned.sort((a, b) => a.depth - b.depth);
    const order = turned.map(({ arm }) => arm);
    if (order.some((arm, k) => svg.children[k] !== arm)) svg.prepend(...order);
  };
}

/** The scale: in the plane a bar of a round length, in space the side of a grid cell. */
export function scaleMark(box) {
  const [bar, text] = box.children;
  return ({ cell, pixels }) => {
    text.textContent = pixels ? lengthText(5 * cell) : `grid ${lengthText(cell)}`;
    bar.style.width = pixels ? `${5 * cell * pixels}px` : "0";
    bar.hidden = !pixels;
  };
}

/** The name of the part under the pointer. */
export function partTip(stageBox, tip, stage, onPoint) {
  let pointed = null;
  const leave = () => {
    if (pointed) onPoint(pointed, false);
    pointed = null;
    tip.hidden = true;
  };
  stageBox.addEventListener("pointermove", (event) => {
    if (event.buttons || event.target.tagName !== "CANVAS" || event.pointerType === "touch") return leave();
    const { left, top, width } = stageBox.getBoundingClientRect();
    const [x, y] = [event.clientX - left, event.clientY - top];
    const part = stage.pick(x, y);
    if (part !== pointed) {
      leave();
      pointed = part;
      if (part) onPoint(part, true);
    }
    tip.hidden = !part;
    if (!part) return;
    tip.textContent = part.name;
    const flip = x > width - tip.offsetWidth - 24;
    tip.style.transform = `translate(${flip ? x - tip.offsetWidth - 8 : x + 14}px, ${y + 12}px)`;
  });
  stageBox.addEventListener("pointerleave", leave);
}
