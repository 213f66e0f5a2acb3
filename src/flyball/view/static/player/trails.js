// Paths of points: a line over the whole motion, and a dot where the point is now.
import * as THREE from "three";
import { ridden, sampleNumbers } from "./data.js";
import { ORDER, flatMaterial, stroke } from "./flats.js";

const POINTS = 1500; // of a path, at most

export class Trail {
  /** The path of a point of a drawn body. */
  constructor(body, position, recording, unit) {
    Object.assign(this, { body, position });
    this.recording = recording;
    const flat = recording.planar;
    this.root = new THREE.Group();
    this.redraw();
    const material = flat ? flatMaterial({ color: body.colour }) : new THREE.MeshBasicMaterial({ color: body.colour });
    const shape = flat ? new THREE.CircleGeometry(0.016 * unit, 32) : new THREE.SphereGeometry(0.014 * unit, 20, 14);
    this.dot = Object.assign(new THREE.Mesh(shape, material), { renderOrder: flat ? ORDER.pin + 9e4 : 0 });
    this.root.add(this.dot);
  }

  /** Draw the line through the recorded times. */
  redraw() {
    const { body, position, recording } = this;
    const flat = recording.planar;
    const numbers = sampleNumbers(recording.t.length, POINTS);
    this.points = ridden(body.data, position, numbers).filter((p) => Number.isFinite(p.x + p.y + p.z));
    if (this.line) {
      this.line.removeFromParent();
      this.line.geometry.dispose();
      this.line.material.dispose();
    }
    this.line = null;
    if (this.points.length < 2) return;
    const look = { color: body.colour, width: 2, order: flat ? ORDER.trail : 0, depthTest: !flat, opacity: 0.8 };
    this.root.add((this.line = stroke(this.points, look)));
  }

  seek() {
    const { group } = this.body;
    this.dot.position
      .set(...this.position)
      .applyQuaternion(group.quaternion)
      .add(group.position);
  }
}
