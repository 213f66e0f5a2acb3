// How the surfaces of lines and arrows look: lit in space; flat, with an ink rim, in the plane.
import * as THREE from "three";
import { flatMaterial } from "./flats.js";

export class Look {
  /** A look for one line; `order` is its place in the painter's order of the plane. */
  constructor(planar, unit, order) {
    Object.assign(this, { planar, rim: 0.004 * unit, order, paints: [], theme: null, glowing: false });
  }

  material(tone) {
    const options = { color: "#888888" };
    const material = this.planar
      ? flatMaterial(options)
      : new THREE.MeshStandardMaterial({ ...options, roughness: 0.38, metalness: 0.1 });
    this.paints.push({ material, tone });
    return material;
  }

  mesh(geometry, material, level = 0) {
    const mesh = new THREE.Mesh(geometry, material);
    Object.assign(mesh, { castShadow: true, receiveShadow: true, frustumCulled: false });
    mesh.renderOrder = this.planar ? this.order + level : 0;
    return mesh;
  }

  /** A round bar along z from 0 to 1, to be stretched; returns the setter of its extent. */
  bar(parent, radius, tone, level = 1) {
    const geometry = this.planar
      ? new THREE.PlaneGeometry(2, 1).rotateX(Math.PI / 2)
      : new THREE.CylinderGeometry(1, 1, 1, 24).rotateX(Math.PI / 2);
    geometry.translate(0, 0, 0.5);
    const parts = [[this.mesh(geometry, this.material(tone), level), 0]];
    if (this.planar && tone !== "rope") parts.push([this.mesh(geometry, this.material("rim"), level - 1), this.rim]);
    for (const [mesh] of parts) parent.add(mesh);
    return (from, to) => {
      for (const [mesh, rim] of parts) {
        mesh.visible = to > from;
        mesh.position.z = from - rim;
        mesh.scale.set(radius + rim, radius + rim, Math.max(to - from + 2 * rim, 1e-9));
      }
    };
  }

  /** The point of an arrow, from z = 0 to 1 with radius 1. */
  head(parent, tone, level = 2) {
    const corners = [
      [0, 1],
      [-1, 0],
      [1, 0],
    ].map(([x, y]) => new THREE.Vector2(x, y));
    const geometry = this.planar
      ? new THREE.ShapeGeometry(new THREE.Shape(corners)).rotateX(Math.PI / 2)
      : new THREE.ConeGeometry(1, 1, 28).rotateX(Math.PI / 2).translate(0, 0, 0.5);
    const mesh = this.mesh(geometry, this.material(tone), level);
    parent.add(mesh);
    return mesh;
  }

  /** An arrow along z, with one head or two (a moment); returns the setter of its length. */
  arrow(parent, radius, tone, heads = 1) {
    const shaft = this.bar(parent, radius, tone);
    const tips = Array.from({ length: heads }, (_, k) => this.head(parent, tone, 2 + k));
    return (length) => {
      const reach = Math.min(7 * radius, (0.6 * length) / (1 + 0.6 * (heads - 1)));
      const width = Math.min(2.6 * radius, 0.42 * reach);
      shaft(0, length - reach);
      tips.forEach((tip, k) => {
        tip.position.z = length - reach * (1 + 0.6 * k);
        tip.scale.set(width, width, reach);
      });
    };
  }

  /** An arc of an arrow about the normal of the plane; returns the setter of the angle it sweeps. */
  arc(parent, radius, wide, tone) {
    const steps = 96;
    const whole = 1.75 * Math.PI;
    const ring = (extra) => new THREE.RingGeometry(radius - wide - extra, radius + wide + extra, steps, 1, 0, whole);
    const parts = [this.mesh(ring(this.rim), this.material("rim"), 0), this.mesh(ring(0), this.material(tone), 1)];
    const turning = new THREE.Group();
    const flipped = new THREE.Group();
    const tip = this.head(turning, tone, 2);
    tip.rotation.x = -Math.PI / 2; // its point along y
    tip.position.x = radius;
    flipped.add(...parts, turning);
    parent.add(flipped);
    const reach = 7 * wide;
    return (angle) => {
      const swept = Math.min(Math.abs(angle), whole);
      const count = Math.round((swept / whole) * steps);
      for (const part of parts) part.geometry.setDrawRange(0, 6 * count);
      tip.scale.set(2.6 * wide, 2.6 * wide, Math.min(reach, 0.8 * swept * radius));
      turning.rotation.z = swept - 0.1 * tip.scale.z;
      flipped.scale.y = angle < 0 ? -1 : 1;
    };
  }

  retheme(theme) {
    this.theme = theme;
    for (const { material, tone } of this.paints) {
      material.color.set(theme[tone]);
      if (this.glowing && tone !== "rim") material.color.lerp(new THREE.Color(theme.accent), 0.6);
    }
  }

  /** Light up, or not. */
  glow(on) {
    this.glowing = on;
    if (this.theme) this.retheme(this.theme);
  }
}
