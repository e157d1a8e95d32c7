/** A second picture beside the first: its camera follows, and it takes over what the first shows. */

import * as three from "three";
import type { Vec3 } from "./backend";
import { carry } from "./carry";
import type { Scale } from "./colors";
import { h } from "./dom";
import { Viewer, type Colors } from "./viewer";

const GRAY = [150, 150, 150, 255]; // what corresponds to nothing

/** Where the camera of a picture stood when its shape filled the picture. */
interface Seat {
  viewer: Viewer;
  turn: three.Matrix4; // from right, up and front to the coordinates of the shape
  target: three.Vector3;
  distance: number;
}

/** How a shape stands. */
export interface Stand {
  up: Vec3;
  towards: Vec3;
}

export class Beside {
  readonly viewer: Viewer;
  readonly stage = h("div", { class: "stage", "data-test": "beside" });
  private readonly watch: ResizeObserver;
  private seats: [Seat, Seat] | null = null;
  private following = false;
  private turn: three.Matrix4 | null = null; // from the first shape to the second, if it is known
  private partners: Int32Array | null = null; // vertex of the first for each of the second
  private marks: Uint8Array | null = null; // of the first

  constructor(
    private readonly first: Viewer,
    private readonly stands: () => [Stand, Stand],
    name: string,
    close: () => void,
  ) {
    first.stage.after(this.stage);
    first.stage.parentElement!.classList.add("compare");
    this.viewer = new Viewer(this.stage);
    const button = { type: "button", "data-test": "close-match", title: "Close the second shape" };
    this.stage.append(
      h("div", { class: "caption" }, name, h("button", { ...button, click: close }, "Close")),
    );
    first.onMove = () => this.follow(0);
    this.viewer.onMove = () => this.follow(1);
    this.watch = new ResizeObserver(() => this.fit());
    this.watch.observe(this.stage);
  }

  show(vertices: Float32Array, faces: Uint32Array): void {
    const { up, towards } = this.stands()[1];
    this.viewer.setMesh(vertices, faces, up, towards);
    this.fit();
  }

  /** Show both shapes whole; from now on one camera follows the other. */
  fit(): void {
    this.seats = null;
    this.first.resize();
    this.viewer.resize();
    if (!this.viewer.vertices.length) return;
    const stands = this.stands();
    this.seats = [this.first, this.viewer].map((viewer, side) => {
      viewer.fit();
      const { up, towards } = stands[side]!;
      const upward = new three.Vector3(...up);
      const right = upward.clone().cross(new three.Vector3(...towards)).normalize();
      const turn = new three.Matrix4().makeBasis(right, upward, right.clone().cross(upward));
      const { target } = viewer.controls;
      const distance = viewer.camera.position.distanceTo(target);
      return { viewer, turn, target: target.clone(), distance };
    }) as [Seat, Seat];
    this.follow(0);
  }

  /** Let the cameras see corresponding sides, by a rotation from the first shape to the second. */
  turnBy(rows: number[] | null): void {
    const [a, b, c, d, e, f, g, h, i] = rows ?? [];
    this.turn = rows && new three.Matrix4().set(a!, b!, c!, 0, d!, e!, f!, 0, g!, h!, i!, 0, 0, 0, 0, 1);
    this.follow(0);
  }

  /** Move the other camera as that of a side has moved. */
  private follow(side: 0 | 1): void {
    if (!this.seats || this.following) return;
    const [from, to] = side === 0 ? this.seats : ([this.seats[1], this.seats[0]] as const);
    const turn = this.turn
      ? this.turn.clone()
      : this.seats[1].turn.clone().multiply(this.seats[0].turn.clone().transpose());
    if (side === 1) turn.transpose();
    const scale = to.distance / from.distance;
    const place = (point: three.Vector3) =>
      point.clone().sub(from.target).applyMatrix4(turn).multiplyScalar(scale).add(to.target);
    this.following = true;
    to.viewer.camera.position.copy(place(from.viewer.camera.position));
    to.viewer.controls.target.copy(place(from.viewer.controls.target));
    to.viewer.controls.update();
    to.viewer.invalidate();
    this.following = false;
  }

  /** Show on the second what the first shows, by the vertex of the first for each of the second. */
  carryBy(partners: Int32Array | null): void {
    this.partners = partners;
    this.first.twin = partners && this.twin;
    this.viewer.setScalars(null);
    this.setMarks(this.marks);
  }

  private readonly twin: Colors = {
    setScalars: (values, scale?: Scale) => {
      this.viewer.setScalars(values && carry(values, this.partners!, 1, scale?.range[0]), scale);
    },
    setLabels: (labels, palette) => {
      this.viewer.setLabels(labels && carry(labels, this.partners!, 1, -1), palette);
    },
    setMarks: (marks) => this.setMarks(marks),
  };

  private setMarks(marks: Uint8Array | null): void {
    this.marks = marks;
    const { partners } = this;
    if (!partners) return this.viewer.setMarks(new Uint8Array((4 * this.viewer.vertices.length) / 3));
    const carried = carry(marks ?? new Uint8Array((4 * this.first.vertices.length) / 3), partners, 4);
    partners.forEach((partner, vertex) => partner < 0 && carried.set(GRAY, 4 * vertex));
    this.viewer.setMarks(carried);
  }

  close(): void {
    this.watch.disconnect();
    this.first.onMove = () => {};
    this.first.twin = null;
    this.viewer.dispose();
    this.stage.remove();
    this.first.stage.parentElement!.classList.remove("compare");
    this.first.resize();
    this.first.fit();
  }
}
