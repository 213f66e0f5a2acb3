// The drawn mechanism: every body, line and joint of a recording as three.js objects, set to any time.
import * as THREE from "three";
import { frameAt, poseAt, sampleNumbers } from "./data.js";
import { ORDER, flatBody, stroke } from "./flats.js";
import { flatJoint } from "./joints2d.js";
import { solidJoint } from "./joints3d.js";
import { buildLine } from "./lines.js";
import { solidBody } from "./solids.js";
import { bodyColours } from "./theme.js";

const TRAIL = 1500; // points of a path, at most

export class Mechanism {
  /** Build everything once; `unit` is the length that symbols scale with. */
  constructor(recording, unit) {
    this.recording = recording;
    this.unit = unit;
    this.root = new THREE.Group();
    const colours = bodyColours(recording.bodies);
    this.bodies = recording.bodies.map((body, k) => this.#body(body, colours[k], k));
    this.lines = recording.lines.map((line, k) => buildLine(line, recording, unit, k));
    this.joints = recording.joints.map((joint, k) => this.#joint(joint, k));
    for (const line of this.lines) this.root.add(line.group);
    this.seek(recording.t[0]);
  }

  #body(body, colour, index) {
    const drawn = this.recording.planar ? flatBody(body, colour, index) : solidBody(body, colour);
    this.root.add(drawn.group);
    if (drawn.shade) this.root.add(drawn.shade);
    drawn.group.traverse((object) => (object.userData.body = index));
    return { ...drawn, name: body.name, colour, data: body, shown: true, trail: null };
  }

  #joint(joint, index) {
    const make = this.recording.planar ? flatJoint : solidJoint;
    const drawn = make(joint, this.recording, this.unit, index);
    const carrier = this.bodies.find((body) => body.name === joint.body);
    (carrier?.group ?? this.root).add(drawn.group);
    return drawn;
  }

  /** Put everything where it is at a time. */
  seek(time) {
    const frame = frameAt(this.recording.t, time);
    for (const body of this.bodies) {
      const { group, shade, data } = body;
      poseAt(data, frame, group);
      group.visible = body.shown && Number.isFinite(group.position.x + group.quaternion.w);
      if (!shade) continue;
      shade.position.copy(group.position).add({ x: 0.012 * this.unit, y: -0.016 * this.unit, z: 0 });
      shade.quaternion.copy(group.quaternion);
      shade.visible = group.visible;
    }
    for (const line of this.lines) line.update(frame);
    return frame;
  }

  /** Position and scalar-first orientation of every body, as set on its object. */
  pose() {
    return this.bodies.map(({ group: { position: p, quaternion: q } }) => [p.x, p.y, p.z, q.w, q.x, q.y, q.z]);
  }

  retheme(theme) {
    for (const part of [...this.bodies, ...this.lines, ...this.joints]) part.retheme(theme);
  }

  show(index, on) {
    const body = this.bodies[index];
    body.shown = on;
    body.group.visible = on;
    if (body.shade) body.shade.visible = on;
  }

  /** The path of a body's origin, on or off. */
  trail(index, on) {
    const body = this.bodies[index];
    if (!body.trail) {
      const { p } = body.data;
      const n = p.length / 3;
      const points = sampleNumbers(n, TRAIL).map((i) => new THREE.Vector3(p[i], p[n + i], p[2 * n + i]));
      const flat = this.recording.planar;
      body.trail = stroke(
        points.filter((point) => Number.isFinite(point.x)),
        {
          color: body.colour,
          width: 2,
          order: flat ? ORDER.trail : 0,
          depthTest: !flat,
          opacity: 0.75,
        },
      );
      this.root.add(body.trail);
    }
    body.trail.visible = on;
  }

  /** The body under a ray, or null; in the plane the one painted last. */
  pick(raycaster) {
    const meshes = [];
    for (const { group } of this.bodies) {
      if (group.visible) group.traverse((object) => object.isMesh && !object.isLineSegments2 && meshes.push(object));
    }
    const hits = raycaster.intersectObjects(meshes, false).filter(({ object }) => object.userData.body !== undefined);
    if (this.recording.planar) hits.sort((a, b) => b.object.renderOrder - a.object.renderOrder);
    return hits.length ? this.bodies[hits[0].object.userData.body] : null;
  }
}
