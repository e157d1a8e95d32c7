/** A second picture beside the first: its camera follows, and it takes over what the first shows. */

import * as three from "three";
import type { Vec3 } from "./backend";
import { carry } from "./carry";
import type { Scale } from "./colors";
import { h } from "./dom";
import { Viewer, type Colors } from "./viewer";

const GRAY = [150, 150, 150, 255]; // what corresponds to nothing

/** How a shape stands. */
export interface Stand {
  up: Vec3;
  towards: Vec3;
}

export class Beside {
  readonly viewer: Viewer;
  readonly stage = h("section", {
    class: "stage",
    "data-test": "beside",
    "aria-label": "The second shape",
  });
  private readonly watch: ResizeObserver;
  private link: three.Matrix4 | null = null; // from the scene of the first to that of the second
  private similarity: number[] | null = null; // lays the first shape on the second
  private following = false;
  private map: [Int32Array, Int32Array] | null = null; // the other's vertex for each of both, or -1
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
    this.viewer.cover(first.covered, true);
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
    const { first, viewer } = this;
    this.link = null;
    first.resize();
    viewer.resize();
    if (!viewer.vertices.length) return;
    viewer.parallel = first.parallel;
    first.fit();
    viewer.fit();
    if (this.similarity) {
      const rows = [...this.similarity, 0, 0, 0, 1] as Parameters<three.Matrix4["set"]>;
      this.link = viewer.space.matrixWorld
        .clone()
        .multiply(new three.Matrix4().set(...rows))
        .multiply(first.space.matrixWorld.clone().invert());
    } else {
      const [one, two] = this.stands().map((stand, side) => seatOf(stand, [first, viewer][side]!));
      this.link = two!.multiply(one!.invert());
    }
    this.follow(0);
  }

  /** Let the cameras see corresponding places, once it is known which correspond. */
  layOn(similarity: number[]): void {
    const before = this.similarity;
    this.similarity = similarity;
    if (!before) this.fit(); // a corrected map leaves the cameras where they are
  }

  /** Move the other camera as that of a side has moved. */
  private follow(side: 0 | 1): void {
    if (!this.link || this.following) return;
    const views = [this.first, this.viewer] as const;
    const [from, to] = [views[side], views[1 - side]!];
    const link = side === 0 ? this.link : this.link.clone().invert();
    this.following = true;
    to.parallel = from.parallel;
    to.camera.position.copy(from.camera.position).applyMatrix4(link);
    to.controls.target.copy(from.controls.target).applyMatrix4(link);
    to.controls.update();
    to.invalidate();
    this.following = false;
  }

  /** Show on the second what the first shows, by the other's vertex for each vertex of both. */
  carryBy(map: [Int32Array, Int32Array] | null): void {
    this.map = map;
    this.first.twin = map && this.twin;
    this.viewer.setScalars(null);
    this.setMarks(this.marks);
  }

  /** Return the vertex of the first that corresponds to one of the second, or -1. */
  partnerOf(vertex: number): number {
    return this.map?.[1][vertex] ?? -1;
  }

  /** Return the vertices of the first that correspond to some of the second. */
  bringBack(vertices: Uint32Array): Uint32Array {
    const there = new Set(vertices);
    const ours = this.map?.[0] ?? new Int32Array(0);
    return Uint32Array.from(ours.keys()).filter((vertex) => there.has(ours[vertex]!));
  }

  private readonly twin: Colors = {
    setScalars: (values, scale?: Scale) => {
      this.viewer.setScalars(values && carry(values, this.map![1], 1, scale?.range[0]), scale);
    },
    setLabels: (labels, palette) => {
      this.viewer.setLabels(labels && carry(labels, this.map![1], 1, -1), palette);
    },
    setMarks: (marks) => this.setMarks(marks),
  };

  private setMarks(marks: Uint8Array | null): void {
    this.marks = marks;
    const partners = this.map?.[1];
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

/** Return how right, up and front of a shape, at its place and distance, lie in the scene. */
function seatOf({ up, towards }: Stand, { camera, controls }: Viewer): three.Matrix4 {
  const upward = new three.Vector3(...up);
  const right = upward.clone().cross(new three.Vector3(...towards)).normalize();
  const distance = camera.position.distanceTo(controls.target);
  return new three.Matrix4()
    .makeBasis(right, upward, right.clone().cross(upward))
    .scale(new three.Vector3().setScalar(distance))
    .setPosition(controls.target);
}
