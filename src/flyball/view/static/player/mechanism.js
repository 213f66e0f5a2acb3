// The drawn mechanism: every body, line and joint of a recording as three.js objects, set to any time.
import * as THREE from "three";
import { Arrows } from "./arrows.js";
import { Batches } from "./batches.js";
import { Crowd } from "./crowd.js";
import { frameAt, pointAt, poseAt } from "./data.js";
import { ORDER, flatBody, stroke } from "./flats.js";
import { flatJoint } from "./joints2d.js";
import { solidJoint } from "./joints3d.js";
import { buildLine } from "./lines.js";
import { FINENESS, refine, solidBody } from "./solids.js";
import { bodyColours, GROUND } from "./theme.js";
import { Trail } from "./trails.js";
import { Triads } from "./triads.js";

const ORIGIN = [0, 0, 0];

export class Mechanism {
  /** Build everything once; symbols scale with `unit`, arrows with the `extent` of the motion. */
  constructor(recording, unit, extent) {
    Object.assign(this, { recording, unit });
    this.root = new THREE.Group();
    this.overlay = new THREE.Group(); // drawn on top of everything else
    const colours = bodyColours(recording.bodies);
    refine(recording.bodies.length);
    this.bodies = recording.bodies.map((body, k) => this.#body(body, colours[k], k));
    const palette = bodyColours([...recording.bodies, ...recording.sets.map(({ name }) => ({ name }))]);
    this.crowds = recording.sets.map((data, k) => this.#crowd(data, palette[recording.bodies.length + k], k));
    this.byName = new Map(this.bodies.map((body) => [body.name, body]));
    this.lines = recording.lines.map((line, k) => this.#line(line, k));
    this.joints = recording.joints.map((joint, k) => this.#joint(joint, k));
    this.curves = recording.curves.map((curve) => this.#curve(curve));
    this.trails = recording.paths.map((path) => ({ name: path.name, ...this.#trail(path.body, path.position) }));
    this.arrows = new Arrows(recording, unit, extent, (rider, out) => this.place(rider, out));
    this.triads = new Triads(recording, unit, this.bodies);
    this.overlay.add(this.arrows.root, this.triads.root);
    this.batches = FINENESS.fine ? null : new Batches(this.root);
    this.seek(recording.t[0]);
  }

  /** To be called before a picture is drawn. */
  prepare() {
    this.batches?.update();
  }

  #body(body, colour, index) {
    const drawn = this.recording.planar ? flatBody(body, colour, index) : solidBody(body, colour);
    this.root.add(drawn.group);
    if (drawn.shade) this.root.add(drawn.shade);
    const part = { ...drawn, name: body.name, category: "body", colour, data: body, shown: true, trail: null };
    drawn.group.traverse((object) => (object.userData.part = part));
    return part;
  }

  #crowd(data, colour, index) {
    const { planar, bodies } = this.recording;
    const crowd = new Crowd(data, colour, { planar, unit: this.unit, order: bodies.length + index });
    this.root.add(crowd.root);
    return crowd;
  }

  #line(line, index) {
    const part = { ...buildLine(line, this.recording, this.unit, index), category: "line" };
    part.group.traverse((object) => (object.userData.part = part));
    this.root.add(part.group);
    return part;
  }

  #joint(joint, index) {
    const make = this.recording.planar ? flatJoint : solidJoint;
    const carrier = this.byName.get(joint.body);
    const drawn = make(joint, this.recording, this.unit, index, carrier?.colour ?? GROUND);
    const part = { ...drawn, name: joint.name, category: "joint", data: joint };
    part.group.traverse((object) => (object.userData.part = part));
    (carrier?.group ?? this.root).add(part.group);
    return part;
  }

  /** A curve on its body: a thin line in the plane, a wire in space. */
  #curve(curve) {
    const n = curve.points.length / 3;
    const points = Array.from({ length: n }, (_, i) => pointAt(curve.points, { i, j: i, f: 0 }, new THREE.Vector3()));
    const carrier = this.byName.get(curve.body);
    const flat = this.recording.planar;
    let object;
    if (flat) {
      const order = carrier ? ORDER.body + 3 * this.bodies.indexOf(carrier) + 2 : ORDER.guide;
      object = stroke(points, { color: GROUND, width: 2.4, order, closed: curve.closed });
    } else {
      const wire = new THREE.TubeGeometry(
        new THREE.CatmullRomCurve3(points, curve.closed),
        2 * n,
        0.006 * this.unit,
        8,
      );
      object = new THREE.Mesh(wire, new THREE.MeshStandardMaterial({ color: GROUND, roughness: 0.4 }));
      object.castShadow = true;
    }
    (carrier?.group ?? this.root).add(object);
    return { retheme: (theme) => object.material.color.set(flat ? theme.ink : theme.metal) };
  }

  #trail(name, position) {
    const body = this.byName.get(name) ?? { group: new THREE.Group(), data: null, colour: GROUND };
    const trail = body.data ? new Trail(body, position, this.recording, this.unit) : null;
    if (trail) this.root.add(trail.root);
    return { trail, colour: body.colour };
  }

  /** Where something is now that rides on a body. */
  place({ body, position }, out) {
    const group = (this.byName.get(body) ?? this.member(body))?.group;
    out.set(...position);
    return group ? out.applyQuaternion(group.quaternion).add(group.position) : out;
  }

  /** The member of a set by a name such as "balls[17]", or null. */
  member(name) {
    for (const crowd of this.crowds) {
      const part = crowd.named(name);
      if (part) return part;
    }
    return null;
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
    for (const crowd of this.crowds) crowd.seek(frame);
    for (const line of this.lines) line.update(frame);
    for (const { trail } of [...this.bodies, ...this.trails]) trail?.seek();
    if (this.arrows.root.visible) this.arrows.seek(frame);
    this.triads.seek();
    return frame;
  }

  /** Position and scalar-first orientation of every body, as set on its object. */
  pose() {
    return this.bodies.map(({ group: { position: p, quaternion: q } }) => [p.x, p.y, p.z, q.w, q.x, q.y, q.z]);
  }

  retheme(theme) {
    const parts = [
      ...this.bodies,
      ...this.crowds,
      ...this.lines,
      ...this.joints,
      ...this.curves,
      this.arrows,
      this.triads,
    ];
    for (const part of parts) part.retheme(theme);
  }

  show(index, on) {
    const body = this.bodies[index];
    body.shown = on;
    body.group.visible = on;
    if (body.shade) body.shade.visible = on;
  }

  /** The path of a body's origin, on or off. */
  trace(index, on) {
    const body = this.bodies[index];
    body.trail ??= this.#trail(body.name, ORIGIN).trail;
    body.trail.root.visible = on;
    body.trail.seek();
  }

  /** The path of a requested point, on or off. */
  showPath(index, on) {
    const { trail } = this.trails[index];
    if (trail) trail.root.visible = on;
  }

  /** Show what another mechanism of the same parts shows. */
  showAs(other) {
    other.bodies.forEach(({ shown, trail }, k) => {
      this.show(k, shown);
      if (trail?.root.visible) this.trace(k, true);
    });
    other.crowds.forEach(({ root }, k) => this.crowds[k].show(root.visible));
    other.trails.forEach(({ trail }, k) => this.showPath(k, trail?.root.visible));
  }

  /** The recording has got other times: paths are drawn anew; forces are those of the earlier ones and disappear. */
  extended() {
    for (const crowd of this.crowds) crowd.extended();
    for (const { trail } of [...this.bodies, ...this.trails]) if (trail?.root.visible) trail.redraw();
    this.arrows.root.visible = false;
  }

  /** Give back what the graphics card holds. */
  dispose() {
    for (const root of [this.root, this.overlay])
      root.traverse(({ geometry, material }) => {
        geometry?.dispose();
        for (const one of [material].flat()) one?.dispose();
      });
  }

  /** Every part of a name that can be lit up: a joint may be drawn with two symbols. */
  parts(name) {
    const member = this.member(name);
    if (member) return [member];
    return [...this.bodies, ...this.lines, ...this.joints].filter((part) => part.name === name);
  }

  /** The part under a ray, or null; in the plane the one painted last. */
  pick(raycaster) {
    const meshes = [];
    const visit = (object) => {
      if (!object.visible) return;
      if (object.isMesh && !object.isLineSegments2 && (object.userData.part || object.userData.crowd || object.userData.meshes))
        meshes.push(object);
      object.children.forEach(visit);
    };
    visit(this.root);
    const hits = raycaster.intersectObjects(meshes, false);
    if (this.recording.planar) hits.sort((a, b) => b.object.renderOrder - a.object.renderOrder);
    if (!hits.length) return null;
    const [{ object, instanceId }] = hits;
    const { crowd, meshes: alike } = object.userData;
    return crowd?.member(instanceId) ?? alike?.[instanceId].userData.part ?? object.userData.part;
  }
}
