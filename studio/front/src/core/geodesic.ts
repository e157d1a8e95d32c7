/** Regions as the library selects them: boxes, and discs along the surface (`BrushRegion`). */

import type { Vec3 } from "./backend";

/** Return the vertices inside a box with sides parallel to the axes, its faces included. */
export function selectBox(points: ArrayLike<number>, low: Vec3, high: Vec3): Uint32Array {
  const found: number[] = [];
  for (let place = 0; place < points.length; place += 3) {
    const inside = [0, 1, 2].every((axis) => {
      const value = points[place + axis]!;
      return value >= low[axis]! && value <= high[axis]!;
    });
    if (inside) found.push(place / 3);
  }
  return Uint32Array.from(found);
}

/**
 * Geodesic discs on one surface, by the waves of the library (`geometry/geodesic_loops.py`, Novotni
 * and Klein 2002): a wave crosses a triangle as if the surface behind it were flat. A disc has one
 * source, so the straight fronts of several sources do not occur.
 */
export class Surface {
  private readonly begins: Uint32Array; // triangles at each vertex, in the order of numpy
  private readonly others: Uint32Array; // their other two corners
  private readonly sides: Float64Array; // lengths from the vertex to each of them, and between them
  private readonly distance: Float64Array;
  private readonly settled: Uint8Array;

  constructor(points: ArrayLike<number>, faces: Uint32Array) {
    const count = points.length / 3;
    this.begins = new Uint32Array(count + 1);
    for (const corner of faces) this.begins[corner + 1]!++;
    for (let vertex = 0; vertex < count; vertex++) this.begins[vertex + 1]! += this.begins[vertex]!;
    this.others = new Uint32Array(2 * faces.length);
    this.sides = new Float64Array(3 * faces.length);
    const next = this.begins.slice();
    const side = (a: number, b: number) =>
      Math.hypot(
        points[3 * a]! - points[3 * b]!,
        points[3 * a + 1]! - points[3 * b + 1]!,
        points[3 * a + 2]! - points[3 * b + 2]!,
      );
    for (let turn = 0; turn < 3; turn++)
      for (let face = 0; face < faces.length; face += 3) {
        const [a, b, c] = [0, 1, 2].map((i) => faces[face + ((i + turn) % 3)]!) as Vec3;
        const entry = next[a]!++;
        this.others.set([b, c], 2 * entry);
        this.sides.set([side(a, b), side(a, c), side(b, c)], 3 * entry);
      }
    this.distance = new Float64Array(count).fill(Infinity);
    this.settled = new Uint8Array(count);
  }

  /** Return the vertices within a geodesic distance of a vertex, nearest first. */
  disc(source: number, radius: number): number[] {
    const { begins, others, sides, distance, settled } = this;
    const heap = new Heap();
    const touched = [source];
    const found: number[] = [];
    distance[source] = 0;
    heap.push(0, source);
    while (heap.size) {
      const [key, vertex] = heap.pop();
      if (settled[vertex]) continue;
      if (key > radius) break;
      settled[vertex] = 1;
      found.push(vertex);
      for (let entry = begins[vertex]!; entry < begins[vertex + 1]!; entry++)
        for (let turn = 0; turn < 2; turn++) {
          const [corner, other] = [others[2 * entry + turn]!, others[2 * entry + 1 - turn]!];
          if (settled[corner]) continue;
          const [toCorner, toOther] = [sides[3 * entry + turn]!, sides[3 * entry + 1 - turn]!];
          let reached = key + toCorner;
          if (settled[other]) {
            const across = sides[3 * entry + 2]!;
            reached = Math.min(reached, throughEdge(key, distance[other]!, toOther, toCorner, across));
          }
          if (reached < distance[corner]!) {
            if (distance[corner] === Infinity) touched.push(corner);
            distance[corner] = reached;
            heap.push(reached, corner);
          }
        }
    }
    for (const vertex of touched) {
      distance[vertex] = Infinity;
      settled[vertex] = 0;
    }
    return found;
  }
}

/** Return the distance of a third corner from a source laid flat behind the opposite edge. */
function throughEdge(near: number, far: number, edge: number, left: number, right: number): number {
  if (edge === 0) return Infinity;
  const x = (near * near - far * far + edge * edge) / (2 * edge);
  const y = Math.sqrt(Math.max(near * near - x * x, 0));
  const cornerX = (left * left - right * right + edge * edge) / (2 * edge);
  const cornerY = Math.sqrt(Math.max(left * left - cornerX * cornerX, 0));
  const depth = y + cornerY;
  if (depth === 0) return Infinity;
  const crossing = x + ((cornerX - x) * y) / depth;
  return crossing < 0 || crossing > edge ? Infinity : Math.hypot(cornerX - x, depth);
}

/** A binary heap of numbers by their keys; equal keys leave it in the same order as in the library. */
class Heap {
  size = 0;
  private readonly keys: number[] = [];
  private readonly items: number[] = [];

  push(key: number, item: number): void {
    let place = this.size++;
    while (place) {
      const above = (place - 1) >> 1;
      if (this.keys[above]! <= key) break;
      this.put(place, this.keys[above]!, this.items[above]!);
      place = above;
    }
    this.put(place, key, item);
  }

  pop(): [number, number] {
    const top: [number, number] = [this.keys[0]!, this.items[0]!];
    const last = --this.size;
    const [key, item] = [this.keys[last]!, this.items[last]!];
    let place = 0;
    for (let below = 1; below < last; below = 2 * place + 1) {
      if (below + 1 < last && this.keys[below + 1]! < this.keys[below]!) below++;
      if (this.keys[below]! >= key) break;
      this.put(place, this.keys[below]!, this.items[below]!);
      place = below;
    }
    this.put(place, key, item);
    return top;
  }

  private put(place: number, key: number, item: number): void {
    this.keys[place] = key;
    this.items[place] = item;
  }
}
