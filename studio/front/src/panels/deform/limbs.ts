/**
 * Limbs: the one under the pointer lights up, and a drag bends it; no region has to be chosen. A limb is
 * a part with all that hangs on it, as the foot hangs on the shin, and has the number of that part.
 */

import * as three from "three";
import type { App } from "../../contract";
import type { Vec3 } from "../../core/backend";
import { softenBorders } from "../../core/borders";
import { isTouch } from "../../core/dom";
import { cutParts, limbOf, touchingParts } from "../../core/parts";
import { PlainDrag } from "../../core/tools";
import type { Hit, PointerTool } from "../../core/viewer";
import type { Motion } from "./motion";
import type { Selection } from "./selection";

const HINT =
  "Point at a limb: it lights up. Drag it, and it bends. Drag anywhere else to turn the view.";
const TOUCH_FIRST = "Tap “Finger: turns” over the picture; then a finger that drags a limb bends it.";
const TOUCH = "Drag a limb: it bends. Drag anywhere else to turn the view; two fingers zoom.";
const KEYS = "Shift with the arrow keys turns it, Enter bends it, Escape lets it go. N: the next one.";
const STEP = Math.PI / 36; // by which a key turns a limb
const NO_LIMBS = "No limb stands out on this shape. Choose a region by hand, under “More”.";

export class Limbs implements PointerTool {
  private labels: Int32Array | null = null; // part of each vertex
  private body = -1; // the largest part, which stays
  private touching: Set<number>[] = []; // parts that each part touches
  private lit = -1;
  private bound = -1; // the limb that can be moved
  private chosen = -1; // by the keyboard
  private binding: Promise<void> = Promise.resolve();
  private last: PointerEvent | null = null; // of the drag that is going on
  private readonly drag: PlainDrag;

  constructor(
    private readonly app: App,
    private readonly motion: Motion,
    private readonly selection: Selection,
  ) {
    this.drag = new PlainDrag(app.viewer);
  }

  /** The parts of another shape are others. */
  startShape(): void {
    this.labels = this.selection.lit = null;
    this.lit = this.chosen = -1;
    this.startPose();
  }

  /** What was bound belongs to the pose before. */
  startPose(): void {
    this.bound = -1;
  }

  /** Load the parts when they are found; return whether there are some. */
  async load(): Promise<boolean> {
    const { backend, state } = this.app;
    if (this.labels || state.parts.status !== "ready") return this.labels !== null;
    const names = ["parts/labels", "parts/cuts"];
    const wanted = Promise.all(names.map((name) => backend.array<Int32Array>(name)));
    // A server that was started anew meanwhile finds them again.
    const [finest, cuts] = await wanted.catch(() => []);
    if (!finest || state.shape !== this.app.state.shape) return false;
    const { levels, n_regions } = state.parts;
    this.labels = cutParts(finest, cuts!, levels.length, n_regions);
    const sizes = new Uint32Array(levels.length);
    for (const label of this.labels) sizes[label]!++;
    this.body = sizes.indexOf(Math.max(...sizes));
    this.touching = touchingParts(this.app.viewer.faces, this.labels, levels.length);
    return true;
  }

  /** What a person should know or do now. */
  get hint(): string {
    const { deformation, parts } = this.app.state;
    const failed = [deformation, parts].find(({ status }) => status === "failed");
    if (failed) return `No limb can be bent yet. ${failed.message}`;
    if (deformation.status === "none") return "A shape as large as this is prepared for bending on request; see above.";
    if (deformation.status !== "ready") return "The shape is being prepared for bending …";
    if (!this.labels) return "Its limbs are being found …";
    if (this.labels.every((label) => label === this.body)) return NO_LIMBS;
    if (!isTouch()) return HINT;
    return this.app.viewer.fingerTurns ? TOUCH_FIRST : TOUCH;
  }

  /** Return the limb of a vertex, or -1. */
  at(vertex: number | undefined): number {
    if (vertex === undefined || !this.labels || this.app.state.deformation.status !== "ready")
      return -1;
    const label = this.labels[vertex]!;
    return label === this.body ? -1 : label;
  }

  hover(hit: Hit | null): void {
    this.light(this.at(hit?.vertex));
  }

  light(limb: number): void {
    if (limb === this.lit) return;
    this.lit = limb;
    this.selection.lit = limb < 0 ? null : this.glowOf(limb);
    this.selection.paint();
    this.app.viewer.canvas.style.cursor = limb < 0 ? "grab" : "pointer";
  }

  /** Return how much each vertex belongs to a limb, of 255, without a step at its rim. */
  private glowOf(limb: number): Uint8Array {
    const parts = limbOf(limb, this.body, this.touching);
    const labels = this.labels!.map((label) => Number(parts.has(label)));
    const paint = Uint8Array.from({ length: 3 * labels.length }, (_, i) =>
      i % 3 ? 0 : 255 * labels[i / 3]!,
    );
    const { soft } = softenBorders(this.app.viewer.faces, labels, paint);
    return soft.filter((_, i) => i % 3 === 0);
  }

  down(event: PointerEvent): boolean {
    const hit = this.app.viewer.pick(event.offsetX, event.offsetY);
    const limb = this.at(hit?.vertex);
    if (!hit || limb < 0) return false;
    this.hold(limb, hit.point);
    return true;
  }

  /** Begin to drag a point of a limb; the motion follows when the limb is bound. */
  hold(limb: number, point: Vec3): Promise<void> {
    this.light(limb);
    this.drag.begin(point);
    this.last = null;
    return this.bind(limb).then(() => this.follow());
  }

  /** Let a limb be moved, unless it can be already. */
  private bind(limb: number): Promise<void> {
    if (limb !== this.bound) {
      this.bound = limb;
      this.binding = this.motion.bind(this.verticesOf(limb)).then(() => {
        if (!this.motion.ready) this.bound = -1; // the next drag asks again
      });
    }
    return this.binding;
  }

  /** Light the next limb, which keys can turn. */
  async next(): Promise<void> {
    const limbs = [...new Set(this.labels)].filter((limb) => limb !== this.body).sort((a, b) => a - b);
    if (!limbs.length) return this.app.say(this.hint);
    this.motion.drop();
    this.chosen = limbs.find((limb) => limb > this.chosen) ?? limbs[0]!;
    this.light(this.chosen);
    this.app.say(KEYS);
  }

  /** Turn the limb that the keyboard has chosen by a step more about an axis of the view. */
  async swing(axis: "above" | "right", sign: 1 | -1): Promise<void> {
    if (this.chosen < 0) await this.next();
    if (this.chosen < 0) return;
    await this.bind(this.chosen);
    if (!this.motion.ready) return;
    const handle = this.motion.rowHandles()[0];
    const turn = new three.Quaternion().setFromAxisAngle(this.app.viewer.axes[axis], sign * STEP);
    if (handle?.type === "rotation")
      turn.multiply(
        new three.Quaternion().setFromAxisAngle(new three.Vector3(...handle.axis), handle.angle),
      );
    const half = new three.Vector3(turn.x, turn.y, turn.z);
    if (!half.length()) return this.motion.drop(); // it has been turned back
    const angle = 2 * Math.atan2(half.length(), turn.w);
    const pivot = this.pivot.toArray();
    await this.motion.moved({ type: "rotation", pivot, axis: half.normalize().toArray(), angle });
  }

  move(event: PointerEvent): void {
    this.last = event;
    this.follow();
  }

  /** The middle of the rim about which the limb turns. */
  get pivot(): three.Vector3 {
    return new three.Vector3(...this.motion.pivotOf(0));
  }

  /** Return the vertex of a limb that is farthest from the body, which the tour bends. */
  farthest(): { number: number; tip: Vec3 } | null {
    const { labels } = this;
    if (!labels || this.app.state.deformation.status !== "ready") return null;
    const { vertices } = this.app.viewer;
    const [center, point] = [new three.Vector3(), new three.Vector3()];
    const body = this.verticesIn(new Set([this.body]));
    for (const vertex of body) center.add(point.fromArray(vertices, 3 * vertex));
    center.divideScalar(body.length);
    let [best, least] = [-1, 0];
    labels.forEach((label, vertex) => {
      const away = point.fromArray(vertices, 3 * vertex).distanceTo(center);
      if (label !== this.body && away > least) [best, least] = [vertex, away];
    });
    if (best < 0) return null;
    return { number: labels[best]!, tip: [...vertices.subarray(3 * best, 3 * best + 3)] as Vec3 };
  }

  /** Return where a point of the limb is after a turn about its pivot. */
  turned(point: Vec3, axis: Vec3, angle: number): Vec3 {
    const { pivot } = this;
    const arm = new three.Vector3(...point).sub(pivot);
    return arm.applyAxisAngle(new three.Vector3(...axis), angle).add(pivot).toArray();
  }

  private follow(): void {
    if (!this.last || !this.motion.ready) return;
    const handle = this.drag.turn(this.last, this.pivot);
    if (handle) this.motion.moved(handle);
  }

  up(): void {
    this.binding.then(() => {
      this.last = null;
      this.motion.commit();
    });
  }

  private verticesOf(limb: number): Uint32Array {
    return this.verticesIn(limbOf(limb, this.body, this.touching));
  }

  private verticesIn(parts: Set<number>): Uint32Array {
    return Uint32Array.from(this.labels!.keys()).filter((each) => parts.has(this.labels![each]!));
  }
}
