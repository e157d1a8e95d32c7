/**
 * Limbs: the one under the pointer lights up, and a drag bends it; no region has to be chosen. A limb is
 * a part with all that hangs on it, as the foot hangs on the shin, and has the number of that part.
 */

import * as three from "three";
import type { App } from "../../contract";
import type { Handle, Vec3 } from "../../core/backend";
import { softenBorders } from "../../core/borders";
import { isTouch, type Form } from "../../core/dom";
import { cutParts, limbOf, touchingParts } from "../../core/parts";
import { MAX_REGIONS } from "../../core/regions";
import { PlainDrag } from "../../core/tools";
import type { Hit, PointerTool } from "../../core/viewer";
import type { Grabbed } from "./grab";
import type { Motion } from "./motion";
import type { Selection } from "./selection";

const HINT =
  "Point at a limb: it lights up. Drag it, and it bends; several, after Shift and a click on each. " +
  "G moves it with the pointer, R turns and S scales it. Drag anywhere else to turn the view.";
const TOUCH_FIRST = "Tap “Finger: turns” over the picture; then a finger that drags a limb bends it.";
const TOUCH = "Drag a limb: it bends. Drag anywhere else to turn the view; two fingers zoom.";
const KEYS = "Shift with the arrow keys turns it, Enter bends it, Escape lets it go. N: the next one.";
const STEP = Math.PI / 36; // by which a key turns a limb
const NO_LIMBS = "No limb stands out on this shape. Choose a region by hand, under “More”.";

/** A limb that moves with another one: alike, or as its mirror image. */
interface Mate {
  limb: number;
  mirrored: boolean;
}

export class Limbs implements PointerTool, Grabbed {
  private labels: Int32Array | null = null; // part of each vertex
  private body = -1; // the largest part, which stays
  private touching: Set<number>[] = []; // parts that each part touches
  private lit = -1;
  private chosen: number[] = []; // by the keyboard, or by Shift and a click
  private bound: Mate[] = []; // the limbs that can be moved; the first one leads
  private centers: three.Vector3[] = []; // of each part with all that hangs on it
  private grabbed = false; // whether a key has begun to move limbs
  private dragged = false; // whether the pointer that is pressed moves limbs, and has not chosen one
  private binding: Promise<void> = Promise.resolve();
  private last: PointerEvent | null = null; // of the drag that is going on
  private readonly drag: PlainDrag;

  constructor(
    private readonly app: App,
    private readonly form: Form,
    private readonly motion: Motion,
    private readonly selection: Selection,
  ) {
    form.on({ mirror: () => this.glow() });
    this.drag = new PlainDrag(app.viewer);
  }

  /** The parts of another shape are others. */
  startShape(): void {
    this.labels = this.selection.lit = null;
    this.lit = -1;
    this.chosen = [];
    this.startPose();
  }

  /** What was bound belongs to the pose before. */
  startPose(): void {
    this.bound = [];
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
    this.centers = [...sizes.keys()].map((part) => this.centerOf(this.verticesOf(part)));
    this.centers[this.body] = this.centerOf(this.verticesIn(new Set([this.body])));
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
    if (!this.grabbed) this.light(this.at(hit?.vertex));
  }

  light(limb: number): void {
    if (limb === this.lit) return;
    this.lit = limb;
    this.glow();
    this.app.viewer.canvas.style.cursor = limb < 0 ? "grab" : "pointer";
  }

  /** Light the limb under the pointer, and all that would move with it. */
  private glow(): void {
    const lit = this.lit < 0 ? this.chosen : [this.lit, ...this.chosen];
    const moving = lit.flatMap((limb) => this.mates(limb).map(({ limb }) => limb));
    this.selection.lit = moving.length ? this.glowOf(moving) : null;
    this.selection.paint();
  }

  /** Return the limbs that move with one: those that are chosen with it, and the mirror image of each. */
  private mates(limb: number): Mate[] {
    const leaders = this.chosen.includes(limb) ? [limb, ...this.chosen] : [limb];
    const found = new Map<number, boolean>(); // whether each moves as a mirror image
    for (const leader of leaders) {
      if (found.has(leader)) continue;
      found.set(leader, false);
      const image = this.imageOf(leader);
      if (image >= 0 && !found.has(image)) found.set(image, true);
    }
    // What hangs on another limb follows that.
    const follows = (one: number) => [...found.keys()].some((other) => other !== one && this.limb(other).has(one));
    const mates = [...found].map(([limb, mirrored]) => ({ limb, mirrored }));
    return mates.filter(({ limb }) => !follows(limb));
  }

  /** The axis along which motions are mirrored, or -1. */
  private get mirror(): number {
    return this.form.get<HTMLSelectElement>("mirror").selectedIndex - 1;
  }

  /** Return the limb that is the mirror image of one, or -1. */
  private imageOf(limb: number): number {
    if (this.mirror < 0) return -1;
    const image = this.nearestToImage(limb);
    // A limb on the plane is its own image; what has no like is not that of its image.
    return image !== limb && this.nearestToImage(image) === limb ? image : -1;
  }

  /** Return the limb whose center is nearest to the mirror image of that of a limb. */
  private nearestToImage(limb: number): number {
    const { body, centers, mirror } = this;
    const middle = centers[body]!.getComponent(mirror);
    const center = centers[limb]!;
    const image = center.clone().setComponent(mirror, 2 * middle - center.getComponent(mirror));
    const away = (part: number) => (part === body ? Infinity : centers[part]!.distanceTo(image));
    return centers.reduce((best, _, part) => (away(part) < away(best) ? part : best), limb);
  }

  /** Return how much each vertex belongs to limbs, of 255, without a step at their rims. */
  private glowOf(limbs: number[]): Uint8Array {
    const parts = new Set(limbs.flatMap((limb) => [...this.limb(limb)]));
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
    this.dragged = !event.shiftKey;
    if (this.dragged) this.hold(limb, hit.point);
    else this.choose(limb);
    return true;
  }

  /** Let a limb move with those that are chosen, or no longer. */
  private choose(limb: number): void {
    const others = this.chosen.filter((each) => each !== limb);
    this.chosen = others.length < this.chosen.length ? others : [...others, limb];
    if (this.mates(limb).length > MAX_REGIONS) {
      this.app.say(`At most ${MAX_REGIONS} limbs move at once, with the mirror images.`);
      this.chosen = others;
    }
    this.glow();
  }

  /** Begin to drag a point of a limb; the motion follows when the limb is bound. */
  hold(limb: number, point: Vec3): Promise<void> {
    this.light(limb);
    this.drag.begin(point);
    this.last = null;
    return this.bind(limb).then(() => this.follow());
  }

  /** Let a limb and its mates be moved, unless they can be already. */
  private bind(limb: number): Promise<void> {
    const mates = this.mates(limb).slice(0, MAX_REGIONS);
    if (JSON.stringify(mates) !== JSON.stringify(this.bound)) {
      this.bound = mates;
      const vertices = mates.map((mate) => this.verticesOf(mate.limb));
      this.binding = this.motion.bind(vertices).then(() => {
        if (!this.motion.ready) this.bound = []; // the next drag asks again
      });
    }
    return this.binding;
  }

  /** Let a key move the limbs that are chosen, or the one under the pointer. */
  async grab(): Promise<Vec3 | null> {
    await this.load();
    const limb = this.chosen.includes(this.lit) || !this.chosen.length ? this.lit : this.chosen[0]!;
    if (limb < 0) {
      this.app.say("Point at a limb, or press N, and then the key.");
      return null;
    }
    this.grabbed = true;
    await this.bind(limb);
    this.grabbed = this.motion.ready;
    return this.grabbed ? this.motion.pivotOf(0) : null;
  }

  release(): void {
    this.grabbed = false;
    this.motion.commit();
  }

  drop(): void {
    this.grabbed = false;
    this.motion.drop();
  }

  /** Let no limb be chosen. */
  letGo(): void {
    this.chosen = [];
    this.light(-1);
    this.glow();
  }

  /** Move the limb that leads, and the others alike about pivots of their own. */
  moved(handle: Handle): Promise<void> {
    const handles = this.bound.map(({ mirrored }, row) =>
      reflect(handle, this.motion.pivotOf(row), mirrored ? this.mirror : -1),
    );
    return this.motion.moveAll(handles);
  }

  /** Light the next limb, which keys can turn. */
  async next(): Promise<void> {
    const limbs = [...new Set(this.labels)].filter((limb) => limb !== this.body).sort((a, b) => a - b);
    if (!limbs.length) return this.app.say(this.hint);
    this.motion.drop();
    const last = this.chosen.at(-1) ?? -1;
    this.chosen = [limbs.find((limb) => limb > last) ?? limbs[0]!];
    this.light(this.chosen[0]!);
    this.app.say(KEYS);
  }

  /** Turn the limb that the keyboard has chosen by a step more about an axis of the view. */
  async swing(axis: "above" | "right", sign: 1 | -1): Promise<void> {
    if (!this.chosen.length) await this.next();
    if (!this.chosen.length) return;
    await this.bind(this.chosen[0]!);
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
    await this.moved({ type: "rotation", pivot, axis: half.normalize().toArray(), angle });
  }

  move(event: PointerEvent): void {
    if (!this.dragged) return;
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
    const [center, point] = [this.centers[this.body]!, new three.Vector3()];
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
    if (handle) this.moved(handle);
  }

  up(): void {
    if (!this.dragged) return;
    this.binding.then(() => {
      this.last = null;
      this.motion.commit();
    });
  }

  /** Return the parts of a limb. */
  private limb(part: number): Set<number> {
    return limbOf(part, this.body, this.touching);
  }

  private verticesOf(limb: number): Uint32Array {
    return this.verticesIn(this.limb(limb));
  }

  private centerOf(vertices: Uint32Array): three.Vector3 {
    const [center, point] = [new three.Vector3(), new three.Vector3()];
    for (const vertex of vertices) center.add(point.fromArray(this.app.viewer.vertices, 3 * vertex));
    return center.divideScalar(vertices.length);
  }

  private verticesIn(parts: Set<number>): Uint32Array {
    return Uint32Array.from(this.labels!.keys()).filter((each) => parts.has(this.labels![each]!));
  }
}

/** Return the same motion about another pivot, mirrored along an axis of the coordinates; -1: not mirrored. */
export function reflect(handle: Handle, pivot: Vec3, axis: number): Handle {
  if (!handle) return null;
  if (handle.type === "scaling") return { ...handle, pivot };
  const turn = handle.type === "rotation";
  // Of a vector the entry across the plane changes its sign; of the axis of a rotation the others do,
  // since the mirror image turns the other way.
  const mirror = (vector: Vec3) =>
    vector.map((value, i) => (axis >= 0 && (i === axis) !== turn ? -value : value)) as Vec3;
  if (turn) return { ...handle, pivot, axis: mirror(handle.axis) };
  return { ...handle, vector: mirror(handle.vector) };
}
