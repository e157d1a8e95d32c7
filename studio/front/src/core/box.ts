/** A box with sides parallel to the axes, and a handle on each side. */

import * as three from "three";
import type { Vec3 } from "./backend";
import type { PointerTool, Viewer } from "./viewer";

const REACH = 14; // pixels from a handle within which the pointer takes it
const COLOR = "#d97a1f";

export class BoxTool implements PointerTool {
  low: Vec3 = [0, 0, 0];
  high: Vec3 = [0, 0, 0];
  private readonly group = new three.Group();
  private readonly edges: three.LineSegments;
  private readonly dots: three.Points;
  private held: { axis: number; upper: boolean } | null = null;

  constructor(
    private readonly viewer: Viewer,
    private readonly onChange: () => void,
    private readonly onEnd: () => void,
  ) {
    const unit = new three.EdgesGeometry(new three.BoxGeometry());
    this.edges = new three.LineSegments(unit, new three.LineBasicMaterial({ color: COLOR }));
    const behind = new three.LineBasicMaterial({ color: COLOR, transparent: true, opacity: 0.35, depthTest: false });
    this.edges.add(new three.LineSegments(unit, behind));
    const dot = new three.PointsMaterial({ color: COLOR, size: 13, sizeAttenuation: false, depthTest: false });
    this.dots = new three.Points(new three.BufferGeometry(), dot);
    this.group.add(this.edges, this.dots);
    for (const object of [this.edges, this.edges.children[0]!, this.dots]) {
      object.frustumCulled = false;
      object.renderOrder = 5;
    }
    this.group.visible = false;
    viewer.space.add(this.group);
  }

  show(low: Vec3, high: Vec3): void {
    [this.low, this.high] = [low, high];
    this.group.visible = true;
    const size = high.map((value, axis) => value - low[axis]!);
    this.edges.scale.set(...(size.map((side) => side || 1e-9) as Vec3));
    this.edges.position.set(...this.middle());
    const centers = this.sides().flatMap(({ axis, upper }) => this.center(axis, upper));
    this.dots.geometry.setAttribute("position", new three.Float32BufferAttribute(centers, 3));
    this.viewer.invalidate();
  }

  hide(): void {
    this.group.visible = false;
    this.viewer.invalidate();
  }

  down(event: PointerEvent): boolean {
    const { clientWidth, clientHeight } = this.viewer.canvas;
    let nearest = REACH;
    this.held = null;
    for (const side of this.sides()) {
      const seen = new three.Vector3(...this.center(side.axis, side.upper));
      seen.applyMatrix4(this.viewer.space.matrixWorld).project(this.viewer.camera);
      const x = ((seen.x + 1) / 2) * clientWidth - event.offsetX;
      const y = ((1 - seen.y) / 2) * clientHeight - event.offsetY;
      const away = Math.hypot(x, y);
      if (away < nearest) [nearest, this.held] = [away, side];
    }
    return this.held !== null;
  }

  /** Move the side to the point of its axis that is nearest to the ray of the pointer. */
  move(event: PointerEvent): void {
    if (!this.held) return;
    const { axis, upper } = this.held;
    const ray = this.viewer.rayAt(event.offsetX, event.offsetY);
    const center = this.center(axis, upper);
    const from = new three.Vector3(...center).sub(ray.origin);
    const along = ray.direction.getComponent(axis);
    const steep = 1 - along * along;
    if (steep < 1e-4) return; // the axis points at the viewer
    const shift = (along * from.dot(ray.direction) - from.getComponent(axis)) / steep;
    const value = center[axis]! + shift;
    const [low, high] = [[...this.low], [...this.high]] as [Vec3, Vec3];
    if (upper) high[axis] = Math.max(value, low[axis]!);
    else low[axis] = Math.min(value, high[axis]!);
    this.show(low, high);
    this.onChange();
  }

  up(): void {
    this.held = null;
    this.onEnd();
  }

  private sides() {
    return [0, 1, 2].flatMap((axis) => [false, true].map((upper) => ({ axis, upper })));
  }

  private middle(): Vec3 {
    return this.low.map((value, axis) => (value + this.high[axis]!) / 2) as Vec3;
  }

  private center(axis: number, upper: boolean): Vec3 {
    const center = this.middle();
    center[axis] = (upper ? this.high : this.low)[axis]!;
    return center;
  }
}
