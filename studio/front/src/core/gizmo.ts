/** How the pointer moves a region: rings and arrows about a pivot, or a plain drag of a point. */

import * as three from "three";
import { TransformControls } from "three/examples/jsm/controls/TransformControls.js";
import type { Handle, Vec3 } from "./backend";
import { rotationFromDrag, subtract } from "./motion";
import type { PointerTool, Viewer } from "./viewer";

export type MotionKind = "rotate" | "move" | "pull" | "swing" | "pivot";

interface Events {
  canDrag(vertex: number): boolean;
  moved(handle: Handle): void;
  released(): void;
  pivoted(pivot: Vec3): void;
}

export class MotionTool implements PointerTool {
  private readonly anchor = new three.Object3D();
  private readonly gizmo: TransformControls;
  private readonly dot: three.Points;
  private kind: MotionKind = "rotate";
  private pivot: Vec3 = [0, 0, 0];
  private grip: { start: Vec3; plane: three.Plane } | null = null;

  constructor(
    private readonly viewer: Viewer,
    private readonly events: Events,
  ) {
    this.gizmo = new TransformControls(viewer.camera, viewer.canvas);
    this.gizmo.size = 0.75;
    const look = { color: "#d8301f", size: 11, sizeAttenuation: false, depthTest: false };
    const origin = new three.BufferGeometry().setFromPoints([new three.Vector3()]);
    this.dot = new three.Points(origin, new three.PointsMaterial(look));
    this.dot.renderOrder = 6;
    this.anchor.add(this.dot);
    this.anchor.visible = false;
    viewer.space.add(this.anchor);
    viewer.scene.add(this.gizmo.getHelper());
    this.gizmo.addEventListener("change", () => viewer.invalidate());
    this.gizmo.addEventListener("dragging-changed", ({ value }) => (viewer.controls.enabled = !value));
    this.gizmo.addEventListener("objectChange", () => this.followGizmo());
    this.gizmo.addEventListener("mouseUp", () => this.releaseGizmo());
  }

  show(pivot: Vec3, kind: MotionKind): void {
    [this.pivot, this.kind] = [pivot, kind];
    this.anchor.position.set(...pivot);
    this.anchor.quaternion.identity();
    this.anchor.visible = kind !== "pull"; // which needs no pivot
    this.viewer.space.updateMatrixWorld(true);
    if (kind === "pull" || kind === "swing") this.gizmo.detach();
    else this.gizmo.attach(this.anchor).setMode(kind === "rotate" ? "rotate" : "translate");
    this.viewer.invalidate();
  }

  hide(): void {
    this.anchor.visible = false;
    this.grip = null;
    this.gizmo.dragging = false;
    this.gizmo.detach();
    this.viewer.invalidate();
  }

  down(event: PointerEvent): boolean {
    if (this.kind !== "pull" && this.kind !== "swing") return false;
    const hit = this.viewer.pick(event.offsetX, event.offsetY);
    if (!hit || !this.events.canDrag(hit.vertex)) return false;
    const facing = this.viewer.camera.getWorldDirection(new three.Vector3());
    const plane = new three.Plane().setFromNormalAndCoplanarPoint(facing, new three.Vector3(...hit.point));
    this.grip = { start: hit.point, plane };
    return true;
  }

  /** The point stays under the pointer, in the plane through it that faces the viewer. */
  move(event: PointerEvent): void {
    const ray = this.viewer.rayAt(event.offsetX, event.offsetY);
    const end = this.grip && ray.intersectPlane(this.grip.plane, new three.Vector3())?.toArray();
    if (!this.grip || !end) return;
    const { start } = this.grip;
    const handle: Handle =
      this.kind === "swing"
        ? rotationFromDrag(this.pivot, start, end)
        : { type: "translation", vector: subtract(end, start) };
    if (handle) this.events.moved(handle);
  }

  up(): void {
    if (this.grip) this.events.released();
    this.grip = null;
  }

  private followGizmo(): void {
    if (this.kind === "rotate") {
      // The angle of the gizmo counts full turns, which a quaternion would lose.
      const { rotationAxis, rotationAngle } = this.gizmo as unknown as {
        rotationAxis: three.Vector3;
        rotationAngle: number;
      };
      const axis = rotationAxis.clone().normalize().toArray();
      this.events.moved({ type: "rotation", pivot: this.pivot, axis, angle: rotationAngle });
    } else if (this.kind === "move") {
      const vector = subtract(this.anchor.position.toArray(), this.pivot);
      this.events.moved({ type: "translation", vector });
    }
  }

  private releaseGizmo(): void {
    if (this.kind === "pivot") this.events.pivoted(this.anchor.position.toArray());
    else this.events.released();
  }
}
