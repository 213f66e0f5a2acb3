// A body dragged with the mouse: the point that was taken, where it is pulled, and the line between them.
import * as THREE from "three";

const SVG = "http://www.w3.org/2000/svg";

function svgElement(tag, parent, attributes = {}) {
  const node = document.createElementNS(SVG, tag);
  for (const [name, value] of Object.entries(attributes)) node.setAttribute(name, value);
  parent.append(node);
  return node;
}

export class Grip {
  /**
   * Dragging in a picture; `onDrag({ body, at, to })` is called while a body is pulled, with the point in its axes and
   * the place in the world, and `onRelease()` at the end. Only bodies for which `isMovable(name)` holds can be taken.
   */
  constructor(picture, onDrag, onRelease, isMovable) {
    Object.assign(this, { picture, onDrag, onRelease, isMovable, held: null });
    const { stage } = picture;
    const svg = svgElement("svg", stage.element, { class: "pull", "aria-hidden": "true" });
    this.line = svgElement("line", svg);
    this.dot = svgElement("circle", svg, { r: 5 });
    this.svg = svg;
    svg.style.display = "none";
    const canvas = stage.element.querySelector("canvas");
    stage.element.addEventListener("pointerdown", (event) => event.target === canvas && this.#take(event, canvas), true);
    canvas.addEventListener("pointermove", (event) => this.#move(event));
    for (const name of ["pointerup", "pointercancel", "lostpointercapture"])
      canvas.addEventListener(name, () => this.release());
  }

  #pixel({ clientX, clientY }) {
    const { left, top } = this.picture.stage.element.getBoundingClientRect();
    return [clientX - left, clientY - top];
  }

  #take(event, canvas) {
    if (event.button !== 0 || this.held) return;
    const { stage, mechanism } = this.picture;
    const pixel = this.#pixel(event);
    const part = stage.pick(...pixel);
    const body = part?.category === "joint" ? this.#moving(part) : part;
    if (body?.category !== "body" || !mechanism.byName.has(body.name) || !this.isMovable(body.name)) return;
    const point = stage.pointAt(...pixel, body.group.position);
    const at = point.clone().sub(body.group.position).applyQuaternion(body.group.quaternion.clone().invert());
    this.held = { body: body.name, at, depth: point, to: point, moved: false, pixel };
    stage.controls.enabled = false;
    canvas.setPointerCapture(event.pointerId);
  }

  /** A body that a joint's symbol stands for: the one that moves in it. */
  #moving({ data }) {
    const { byName } = this.picture.mechanism;
    return byName.get(data.mate) ?? byName.get(data.body);
  }

  #move(event) {
    const { held } = this;
    if (!held) return;
    held.pixel = this.#pixel(event);
    held.to = this.picture.stage.pointAt(...held.pixel, held.depth);
    held.moved = true;
    this.pull();
    this.draw();
  }

  /** Say again where the body is pulled. */
  pull() {
    const { held } = this;
    if (held?.moved) this.onDrag({ body: held.body, at: held.at.toArray(), to: held.to.toArray() });
  }

  release() {
    const { held } = this;
    if (!held) return;
    this.held = null;
    this.picture.stage.controls.enabled = true;
    this.svg.style.display = "none";
    if (held.moved) this.onRelease();
  }

  /** The line from the body's point to the mouse. */
  draw() {
    const { held, picture } = this;
    if (!held?.moved) return;
    const { stage, mechanism } = picture;
    const p = mechanism.place({ body: held.body, position: held.at.toArray() }, new THREE.Vector3()).project(stage.camera);
    const [width, height] = stage.size;
    const [x, y] = [((p.x + 1) * width) / 2, ((1 - p.y) * height) / 2];
    const ends = { x1: x, y1: y, x2: held.pixel[0], y2: held.pixel[1] };
    for (const [name, value] of Object.entries(ends)) this.line.setAttribute(name, value);
    this.dot.setAttribute("cx", x);
    this.dot.setAttribute("cy", y);
    this.svg.style.display = "";
  }
}
