/** What the pointer moves on the shape: the sides of a box, or a region by a gizmo or a point. */

import * as three from "three";
import { TransformControls } from "three/examples/jsm/controls/TransformControls.js";
import type { Handle, Vec3 } from "./backend";
import type { PointerTool, Viewer } from "./viewer";

const REACH = 14; // pixels from a handle within which the pointer takes it
const BOX_COLOR = "#d97a1f";
const PIVOT_COLOR = "#d8301f";
// As in the library: sine over cosine below which two directions are parallel.
const PARALLEL = 1e-12;

/** Return dots of constant size on the screen that nothing hides. */
function buildDots(places: three.Vector3[], color: string, size: number): three.Points {
  const look = { color, size, sizeAttenuation: false, depthTest: false };
  const geometry = new three.BufferGeometry().setFromPoints(places);
  const dots = new three.Points(geometry, new three.PointsMaterial(look));
  dots.frustumCulled = false;
  dots.renderOrder = 6;
  return dots;
}

/** A box with sides parallel to the axes, and a handle on each side. */
export class BoxTool implements PointerTool {
  readonly box = new three.Box3();
  private readonly group = new three.Group();
  private readonly dots = buildDots(this.handles(), BOX_COLOR, 13);
  private held = -1; // place of the handle in `handles`

  constructor(
    private readonly viewer: Viewer,
    private readonly onChange: () => void,
    private readonly onEnd: () => void,
  ) {
    const hidden = new three.Box3Helper(this.box, new three.Color(BOX_COLOR));
    hidden.material = new three.LineBasicMaterial({
      color: BOX_COLOR,
      transparent: true,
      opacity: 0.35,
      depthTest: false, // the edges behind the shape are faint
    });
    this.group.add(new three.Box3Helper(this.box, new three.Color(BOX_COLOR)), hidden, this.dots);
    for (const object of this.group.children) object.renderOrder = 5;
    viewer.space.add(this.group);
    this.show(false);
  }

  get low(): Vec3 {
    return this.box.min.toArray();
  }

  get high(): Vec3 {
    return this.box.max.toArray();
  }

  set(low: Vec3, high: Vec3): void {
    this.box.min.set(...low);
    this.box.max.set(...high);
    this.dots.geometry.setFromPoints(this.handles());
    this.viewer.invalidate();
  }

  show(visible: boolean): void {
    this.group.visible = visible;
    this.viewer.invalidate();
  }

  /** Return the vertices inside, the faces of the box included. */
  select(points: ArrayLike<number>): number[] {
    const [found, point]: [number[], three.Vector3] = [[], new three.Vector3()];
    for (let vertex = 0; 3 * vertex < points.length; vertex++)
      if (this.box.containsPoint(point.fromArray(points, 3 * vertex))) found.push(vertex);
    return found;
  }

  down(event: PointerEvent): boolean {
    const { clientWidth, clientHeight } = this.viewer.canvas;
    const away = this.handles().map((handle) => {
      const seen = handle.applyMatrix4(this.viewer.space.matrixWorld).project(this.viewer.camera);
      const x = ((seen.x + 1) / 2) * clientWidth - event.offsetX;
      const y = ((1 - seen.y) / 2) * clientHeight - event.offsetY;
      return Math.hypot(x, y);
    });
    const least = Math.min(...away);
    this.held = away.indexOf(least);
    return least < REACH;
  }

  /** Move the side to the point of its axis that is nearest to the ray of the pointer. */
  move(event: PointerEvent): void {
    const axis = this.held % 3;
    const center = this.handles()[this.held]!;
    const along = new three.Vector3().setComponent(axis, 100 * this.viewer.extent);
    const ends = [center.clone().sub(along), center.add(along)] as const;
    const nearest = new three.Vector3();
    this.viewer
      .rayAt(event.offsetX, event.offsetY)
      .distanceSqToSegment(...ends, undefined, nearest);
    const [low, high] = [this.low, this.high];
    const value = nearest.getComponent(axis);
    if (this.held < 3) low[axis] = Math.min(value, high[axis]!);
    else high[axis] = Math.max(value, low[axis]!);
    this.set(low, high);
    this.onChange();
  }

  up(): void {
    this.onEnd();
  }

  /** Return the centers of the three lower and the three upper sides. */
  private handles(): three.Vector3[] {
    return [this.box.min, this.box.max].flatMap((corner) =>
      [0, 1, 2].map((axis) => {
        const center = this.box.getCenter(new three.Vector3());
        return center.setComponent(axis, corner.getComponent(axis));
      }),
    );
  }
}

export type MotionKind = "rotate" | "move" | "pull" | "swing" | "pivot";

export interface MotionEvents {
  canDrag(vertex: number): boolean;
  moved(handle: Handle): void;
  released(): void;
  pivoted(pivot: Vec3): void;
}

/** A drag of a point: it stays under the pointer, in the plane through it that faces the viewer. */
export class PlainDrag {
  private readonly start = new three.Vector3();
  private readonly plane = new three.Plane();

  constructor(private readonly viewer: Viewer) {}

  begin(point: Vec3): void {
    const facing = this.viewer.camera.getWorldDirection(new three.Vector3());
    this.plane.setFromNormalAndCoplanarPoint(facing, this.start.set(...point));
  }

  /** Return the rotation about a pivot that brings the point towards the pointer. */
  turn(event: PointerEvent, pivot: three.Vector3): Handle {
    const end = this.end(event);
    return end && rotationFromDrag(pivot, this.start, end);
  }

  shift(event: PointerEvent): Handle {
    const end = this.end(event);
    return end && { type: "translation", vector: end.sub(this.start).toArray() };
  }

  private end({ offsetX, offsetY }: PointerEvent): three.Vector3 | null {
    return this.viewer.rayAt(offsetX, offsetY).intersectPlane(this.plane, new three.Vector3());
  }
}

/** Rings and arrows about a pivot, or a plain drag of a point: turn, move, pull, swing. */
export class MotionTool implements PointerTool {
  private readonly anchor = new three.Object3D(); // that the gizmo moves
  private readonly gizmo: TransformControls;
  private kind: MotionKind = "rotate";
  private pivot = new three.Vector3();
  private readonly drag: PlainDrag;

  constructor(
    private readonly viewer: Viewer,
    private readonly events: MotionEvents,
  ) {
    this.drag = new PlainDrag(viewer);
    this.gizmo = new TransformControls(viewer.camera, viewer.canvas);
    this.gizmo.size = 0.75;
    this.anchor.add(buildDots([new three.Vector3()], PIVOT_COLOR, 11));
    this.anchor.visible = false;
    viewer.space.add(this.anchor);
    viewer.scene.add(this.gizmo.getHelper());
    this.gizmo.addEventListener("change", () => viewer.invalidate());
    this.gizmo.addEventListener("dragging-changed", ({ value }) => {
      viewer.controls.enabled = !value;
    });
    this.gizmo.addEventListener("objectChange", () => this.followGizmo());
    this.gizmo.addEventListener("mouseUp", () => {
      if (this.kind === "pivot") events.pivoted(this.anchor.position.toArray());
      else events.released();
    });
  }

  show(pivot: Vec3, kind: MotionKind): void {
    this.kind = kind;
    this.pivot.set(...pivot);
    this.anchor.position.copy(this.pivot);
    this.anchor.quaternion.identity();
    this.anchor.visible = kind !== "pull"; // which needs no pivot
    this.viewer.space.updateMatrixWorld(true);
    if (kind === "pull" || kind === "swing") this.gizmo.detach();
    else this.gizmo.attach(this.anchor).setMode(kind === "rotate" ? "rotate" : "translate");
    this.viewer.invalidate();
  }

  hide(): void {
    this.anchor.visible = false;
    this.gizmo.dragging = false;
    this.gizmo.detach();
    this.viewer.invalidate();
  }

  down(event: PointerEvent): boolean {
    if (this.kind !== "pull" && this.kind !== "swing") return false;
    const hit = this.viewer.pick(event.offsetX, event.offsetY);
    if (!hit || !this.events.canDrag(hit.vertex)) return false;
    this.drag.begin(hit.point);
    return true;
  }

  move(event: PointerEvent): void {
    const { drag, kind } = this;
    const handle = kind === "swing" ? drag.turn(event, this.pivot) : drag.shift(event);
    if (handle) this.events.moved(handle);
  }

  up(): void {
    this.events.released();
  }

  private followGizmo(): void {
    const pivot = this.pivot.toArray();
    if (this.kind === "rotate") {
      // The angle of the gizmo counts full turns, which a quaternion would lose.
      const { rotationAxis, rotationAngle: angle } = this.gizmo as unknown as {
        rotationAxis: three.Vector3;
        rotationAngle: number;
      };
      const axis = rotationAxis.clone().normalize().toArray();
      this.events.moved({ type: "rotation", pivot, axis, angle });
    } else if (this.kind === "move") {
      const vector = this.anchor.position.clone().sub(this.pivot).toArray();
      this.events.moved({ type: "translation", vector });
    }
  }
}

/** Return the smallest rotation that turns one point towards another, or null if there are many. */
export function rotationFromDrag(
  pivot: three.Vector3,
  start: three.Vector3,
  end: three.Vector3,
): Handle {
  const [before, after] = [start, end].map((point) => point.clone().sub(pivot).normalize());
  const axis = before!.clone().cross(after!);
  const [along, across] = [before!.dot(after!), axis.length()];
  const turn = { type: "rotation", pivot: pivot.toArray() } as const;
  if (across > PARALLEL * Math.abs(along))
    return { ...turn, axis: axis.normalize().toArray(), angle: Math.atan2(across, along) };
  // Parallel directions need no turn; for opposite ones, and from the pivot itself, any axis fits.
  return along > 0 ? { ...turn, axis: [0, 0, 1], angle: 0 } : null;
}
