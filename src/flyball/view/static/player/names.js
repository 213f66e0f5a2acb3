// Names of bodies and joints beside them in the picture.
import * as THREE from "three";
import { element } from "./format.js";
import { cornersOf } from "./solids.js";

const MOST = 80;
const [HIGH, WIDE] = [15, 6.6]; // px: height of a label, width of a letter

/** The middle of a body's shapes, in its axes. */
function middle({ shapes }) {
  const box = new THREE.Box3().setFromPoints(shapes.flatMap(cornersOf));
  return box.isEmpty() ? [0, 0, 0] : box.getCenter(new THREE.Vector3()).toArray();
}

export class Names {
  /** Labels over the picture; they follow the drawn parts. */
  constructor(box, mechanism) {
    const once = new Set();
    const parts = [
      ...mechanism.bodies.map((body) => ({
        name: body.name,
        body: body.name,
        data: body.data,
        kind: "body",
      })),
      ...mechanism.joints.map(({ data }) => ({ ...data, kind: "joint" })),
    ].filter(({ name }) => once.size < MOST && !once.has(name) && once.add(name));
    this.mechanism = mechanism;
    this.box = box;
    box.replaceChildren();
    this.parts = parts.map((part) => {
      const label = element("span", { className: part.kind, textContent: part.name });
      box.append(label);
      return { ...part, position: part.position ?? middle(part.data), label };
    });
    box.hidden = true;
  }

  show(on) {
    this.box.hidden = !on;
  }

  /** Put the labels where their parts are in a picture of this size. */
  update(camera, [width, height]) {
    if (this.box.hidden) return;
    const p = new THREE.Vector3();
    const taken = [];
    for (const part of this.parts) {
      this.mechanism.place(part, p).project(camera);
      const inside = p.z < 1 && Math.abs(p.x) < 1 && Math.abs(p.y) < 1;
      part.label.hidden = !inside;
      if (!inside) continue;
      const [x, wide] = [((p.x + 1) * width) / 2, WIDE * part.name.length + 8];
      let y = ((1 - p.y) * height) / 2 + (part.kind === "joint" ? HIGH : 0);
      // a label that would lie on another one goes below it
      const clash = (other) => Math.abs(other.y - y) < HIGH && x < other.x + other.wide && other.x < x + wide;
      for (let other = taken.find(clash), tries = 0; other && tries < 8; other = taken.find(clash), tries++)
        y = other.y + HIGH;
      taken.push({ x, y, wide });
      part.label.style.transform = `translate(${x}px, ${y}px)`;
    }
  }
}
