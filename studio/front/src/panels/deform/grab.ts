/** Motions that a key begins and the pointer goes on with, as in Blender: G moves, R turns, S scales. */

import * as three from "three";
import type { App } from "../../contract";
import type { Handle, Vec3 } from "../../core/backend";
import { formatNumber } from "../../core/colors";

export const GRABS = [
  ["G", "move"],
  ["R", "turn"],
  ["S", "scale"],
] as const;
export type GrabKind = (typeof GRABS)[number][1];

const KEYS = "X, Y and Z: along an axis. Numbers: exactly. Enter or a click applies it, Escape drops it.";
const LEAST = 0.1; // sine of the angle to the line of sight, below which a drag says little of an axis
const SMALLEST = 0.01; // factor

/** What the keys move: limbs, or a region. */
export interface Grabbed {
  /** Let it be moved, and return its pivot; null if nothing can be moved, and the status says why. */
  grab(): Promise<Vec3 | null>;
  moved(handle: Handle): void;
  release(): void;
  drop(): void;
}

interface Grip {
  kind: GrabKind;
  grabbed: Grabbed;
  pivot: three.Vector3;
  begin: [number, number]; // where the pointer was, in pixels of the canvas
  angle: number; // by which the pointer has gone around the pivot
  axis: number; // of the coordinates; -1: none
  typed: string;
  end: AbortController;
}

export class Grab {
  private place: [number, number] = [0, 0]; // of the pointer
  private grip: Grip | null = null;
  private grips = 0; // counts them, so that only the last one begins

  constructor(private readonly app: App) {
    app.viewer.canvas.addEventListener("pointermove", ({ offsetX, offsetY }) => {
      const { grip } = this;
      const [before, place]: [number, number][] = [this.place, [offsetX, offsetY]];
      this.place = place;
      if (!grip) return;
      grip.angle += this.angleBetween(grip.pivot, before, place);
      this.follow(grip);
    });
  }

  /** Let the pointer move something until a click, Enter or Escape. */
  async begin(kind: GrabKind, grabbed: Grabbed): Promise<void> {
    this.finish(false);
    const begin = this.place;
    const number = ++this.grips;
    const found = await grabbed.grab();
    if (!found || number !== this.grips) return;
    const end = new AbortController();
    const pivot = new three.Vector3(...found);
    const angle = this.angleBetween(pivot, begin, this.place); // the pointer has gone on meanwhile
    const grip = { kind, grabbed, pivot, begin, angle, axis: -1, typed: "", end };
    this.grip = grip;
    // Before anything else hears of them.
    const options = { capture: true, signal: end.signal };
    window.addEventListener("keydown", (event) => this.press(grip, event), options);
    const click = (event: PointerEvent) => {
      event.stopPropagation();
      this.finish(event.button === 0);
    };
    this.app.viewer.stage.addEventListener("pointerdown", click, options);
    this.follow(grip);
  }

  /** Apply the motion that goes on, or drop it. */
  finish(apply: boolean): void {
    const { grip } = this;
    this.grip = null;
    grip?.end.abort();
    if (grip) this.app.say("");
    if (apply) grip?.grabbed.release();
    else grip?.grabbed.drop();
  }

  private press(grip: Grip, event: KeyboardEvent): void {
    const { key } = event;
    if (event.ctrlKey || event.metaKey) return this.finish(false); // it may undo, for example
    const axis = ["x", "y", "z"].indexOf(key.toLowerCase());
    const ends = ["Enter", " ", "Escape"].includes(key);
    if (axis >= 0) grip.axis = axis === grip.axis ? -1 : axis;
    else if (/^[\d.-]$/.test(key)) grip.typed += key;
    else if (key === "Backspace") grip.typed = grip.typed.slice(0, -1);
    else if (!ends) return;
    event.preventDefault();
    event.stopImmediatePropagation();
    if (ends) this.finish(key !== "Escape");
    else this.follow(grip);
  }

  /** Move what is grabbed to where the pointer is, or by the number that was typed. */
  private follow(grip: Grip): void {
    const { kind } = grip;
    const handle = kind === "move" ? this.shift(grip) : kind === "turn" ? this.turn(grip) : this.size(grip);
    this.app.say(`${describe(handle)} ${KEYS}`);
    grip.grabbed.moved(handle);
  }

  private shift({ axis, begin, pivot, typed }: Grip): Handle {
    const vector = this.beside(pivot, this.place).sub(this.beside(pivot, begin));
    if (axis >= 0 || typed) {
      const direction = new three.Vector3().setComponent(Math.max(axis, 0), 1); // unless chosen: x
      // The axis is seen shortened, by the sine of its angle to the line of sight.
      const sine = direction.clone().cross(this.app.viewer.axes.towards).length();
      const along = vector.dot(direction) / Math.max(sine, LEAST) ** 2;
      vector.copy(direction).multiplyScalar(typed ? numberOf(typed) : along);
    }
    return { type: "translation", vector: vector.toArray() };
  }

  private turn({ angle, axis, pivot, typed }: Grip): Handle {
    const { towards } = this.app.viewer.axes;
    const direction = axis < 0 ? towards : new three.Vector3().setComponent(axis, 1);
    const seen = direction.dot(towards) < 0 ? -angle : angle;
    return {
      type: "rotation",
      pivot: pivot.toArray(),
      axis: direction.toArray(),
      angle: typed ? (numberOf(typed) * Math.PI) / 180 : seen,
    };
  }

  private size({ axis, begin, pivot, typed }: Grip): Handle {
    const [x, y] = this.app.viewer.placeOf(pivot.toArray());
    const [before, after] = [begin, this.place].map((place) => Math.hypot(place[0] - x, place[1] - y));
    const factor = typed ? numberOf(typed) || 1 : after! / Math.max(before!, 1);
    const size = Math.max(Math.abs(factor), SMALLEST);
    const factors = [0, 1, 2].map((each) => (axis < 0 || each === axis ? size : 1)) as Vec3;
    return { type: "scaling", pivot: pivot.toArray(), factors };
  }

  /** Return the point under a place of the canvas in the plane of a point that faces the viewer. */
  private beside(point: three.Vector3, [x, y]: [number, number]): three.Vector3 {
    const { viewer } = this.app;
    const plane = new three.Plane();
    plane.setFromNormalAndCoplanarPoint(viewer.axes.towards, point);
    return viewer.rayAt(x, y).intersectPlane(plane, new three.Vector3()) ?? point.clone();
  }

  /** Return the angle about a point as it is seen, counter-clockwise, from one place to another. */
  private angleBetween(point: three.Vector3, one: [number, number], two: [number, number]): number {
    const [x, y] = this.app.viewer.placeOf(point.toArray());
    const [before, after] = [one, two].map((place) => Math.atan2(y - place[1], place[0] - x));
    const angle = after! - before!;
    return angle - 2 * Math.PI * Math.round(angle / (2 * Math.PI));
  }
}

/** Return the number that is typed; 0 until there is one. */
const numberOf = (typed: string) => Number(typed) || 0;

function describe(handle: Handle): string {
  if (!handle) return "";
  const list = (numbers: Vec3) => numbers.map((each) => formatNumber(each)).join(", ");
  if (handle.type === "translation") return `Move by ${list(handle.vector)}.`;
  if (handle.type === "scaling") return `Scale by ${list(handle.factors)}.`;
  return `Turn by ${formatNumber((handle.angle * 180) / Math.PI)}° about ${list(handle.axis)}.`;
}
