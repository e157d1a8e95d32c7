/** The edges of the faces, drawn on demand over the surface. */

import * as three from "three";
import type { Motion } from "./motion";
import type { Surface } from "./surface";
import edgesFragment from "../shaders/edges.frag.glsl?raw";
import edgesVertex from "../shaders/edges.vert.glsl?raw";

export class Edges extends three.LineSegments<three.BufferGeometry, three.ShaderMaterial> {
  constructor(
    private readonly surface: Surface,
    motion: Motion,
  ) {
    super(new three.BufferGeometry(), motion.material(edgesVertex, edgesFragment, {}));
    this.material.transparent = true;
    this.frustumCulled = this.visible = false;
  }

  show(visible: boolean): void {
    this.visible = visible;
    if (visible) this.surface.shareBuffers(this.geometry, findEdges(this.surface.faces));
  }
}

/** Return both ends of each edge of some faces, every edge once. */
export function findEdges(faces: Uint32Array): Uint32Array {
  const count = 1 + faces.reduce((most, vertex) => Math.max(most, vertex), 0);
  const edges = new Set<number>();
  faces.forEach((start, place) => {
    const end = faces[place % 3 === 2 ? place - 2 : place + 1]!;
    edges.add(Math.min(start, end) * count + Math.max(start, end));
  });
  return Uint32Array.from([...edges].flatMap((edge) => [Math.floor(edge / count), edge % count]));
}
