/** The points of a scan, shown in place of the surface that was made of them. */

import * as three from "three";
import { h } from "./dom";
import type { Viewer } from "./viewer";

const [COLOR, SIZE] = ["#3b8fd4", 3]; // of a point, in pixels

export class Cloud {
  private readonly points: three.Points<three.BufferGeometry, three.PointsMaterial>;
  private readonly buttons = ["Points", "Surface"].map((text) =>
    h("button", { type: "button", click: () => this.show(text === "Points") }, text),
  );
  private readonly choice = h(
    "div",
    { class: "row choice cloud", role: "group", "aria-label": "Show", "data-test": "cloud" },
    ...this.buttons,
  );

  constructor(
    private readonly viewer: Viewer,
    places: Float32Array,
  ) {
    const geometry = new three.BufferGeometry();
    geometry.setAttribute("position", new three.BufferAttribute(places, 3));
    const look = { color: COLOR, size: SIZE, sizeAttenuation: false };
    this.points = new three.Points(geometry, new three.PointsMaterial(look));
    this.points.frustumCulled = false;
    viewer.space.add(this.points);
    viewer.stage.append(this.choice);
  }

  /** Show the points, or the surface, which is what panels work on. */
  show(points: boolean): void {
    this.points.visible = points;
    this.viewer.surface.visible = !points;
    this.buttons.forEach((button, i) => button.setAttribute("aria-pressed", String(points === !i)));
    this.viewer.invalidate();
  }

  remove(): void {
    this.show(false);
    this.viewer.space.remove(this.points);
    this.points.geometry.dispose();
    this.points.material.dispose();
    this.choice.remove();
  }
}
