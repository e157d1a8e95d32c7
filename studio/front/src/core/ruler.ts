/** A ruler: two clicks on the shape, and how far apart they are. */

import * as three from "three";
import type { Vec3 } from "./backend";
import { formatNumber } from "./colors";
import { h } from "./dom";
import type { Viewer } from "./viewer";

const COLOR = "#d8301f";

export class Ruler {
  private points: Vec3[] = [];
  private readonly line = new three.Line(
    new three.BufferGeometry(),
    new three.LineBasicMaterial({ color: COLOR, depthTest: false }),
  );
  private readonly label = h("div", { class: "tip", "data-test": "length", hidden: true });

  constructor(private readonly viewer: Viewer) {
    this.line.renderOrder = 7;
    this.line.frustumCulled = false;
    viewer.space.add(this.line);
    viewer.stage.append(this.label);
    viewer.onDraw.push(() => this.placeLabel());
    this.show([]);
  }

  /** Take clicks, until `stop`. */
  start(): void {
    this.viewer.takeClicks(({ point }) => {
      this.show(this.points.length === 1 ? [...this.points, point] : [point]);
    });
  }

  stop(): void {
    this.viewer.takeClicks(null);
    this.show([]);
  }

  private show(points: Vec3[]): void {
    this.points = points;
    this.line.visible = points.length === 2;
    this.line.geometry.dispose();
    const ends = points.map((point) => new three.Vector3(...point));
    this.line.geometry = new three.BufferGeometry().setFromPoints(ends);
    this.label.hidden = !points.length;
    this.label.textContent = this.measure();
    this.viewer.invalidate();
  }

  private measure(): string {
    const [from, to] = this.points.map((point) => new three.Vector3(...point));
    return from && to ? formatNumber(from.distanceTo(to)) : "Click the other end.";
  }

  private placeLabel(): void {
    if (!this.points.length) return;
    const places = this.points.map((point) => this.viewer.placeOf(point));
    const [left, top] = [0, 1].map((axis) => places.reduce((sum, place) => sum + place[axis]!, 0));
    Object.assign(this.label.style, {
      left: `${left! / places.length}px`,
      top: `${top! / places.length}px`,
    });
  }
}
