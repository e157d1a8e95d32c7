/** The mathematics of motions, in double precision: as in the library's `handles.py`. */

import type { Handle, Vec3 } from "./backend";

export const add = (a: Vec3, b: Vec3): Vec3 => [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
export const subtract = (a: Vec3, b: Vec3): Vec3 => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
export const scale = (a: Vec3, factor: number): Vec3 => [a[0] * factor, a[1] * factor, a[2] * factor];
export const dot = (a: Vec3, b: Vec3): number => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
export const cross = (a: Vec3, b: Vec3): Vec3 => [
  a[1] * b[2] - a[2] * b[1],
  a[2] * b[0] - a[0] * b[2],
  a[0] * b[1] - a[1] * b[0],
];
export const length = (a: Vec3): number => Math.hypot(...a);
export const vertexOf = (points: ArrayLike<number>, vertex: number): Vec3 => [
  points[3 * vertex]!,
  points[3 * vertex + 1]!,
  points[3 * vertex + 2]!,
];

/** Return the displacement of a point under its share of a motion. */
export function carry(handle: Handle, point: Vec3, share: number): Vec3 {
  if (!handle) return [0, 0, 0];
  if (handle.type === "translation") return scale(handle.vector, share);
  const angle = share * handle.angle;
  const side = cross(handle.axis, subtract(point, handle.pivot));
  const inward = cross(handle.axis, side);
  // 1 - cos x = 2 sin²(x/2), which keeps the digits of small angles
  return add(scale(side, Math.sin(angle)), scale(inward, 2 * Math.sin(angle / 2) ** 2));
}

// As PARALLEL of the library: sine over cosine below which two directions are parallel.
const PARALLEL = 1e-12;

/** Return the smallest rotation that turns one point towards another, or null if there are many. */
export function rotationFromDrag(pivot: Vec3, start: Vec3, end: Vec3): Handle {
  const [before, after] = [start, end].map((point) => {
    const arm = subtract(point, pivot);
    return scale(arm, 1 / Math.max(...arm.map(Math.abs)));
  }) as [Vec3, Vec3];
  if (![...before, ...after].every(Number.isFinite)) return null; // a point is the pivot
  const axis = cross(before, after);
  const along = dot(before, after);
  const across = length(axis);
  if (across <= PARALLEL * Math.abs(along))
    return along < 0 ? null : { type: "rotation", pivot, axis: [0, 0, 1], angle: 0 };
  return { type: "rotation", pivot, axis: scale(axis, 1 / across), angle: Math.atan2(across, along) };
}

/** Return the vertices of a region that have a neighbor outside it (`region_boundary`). */
export function regionBoundary(faces: Uint32Array, inside: Uint8Array): number[] {
  const rim = new Set<number>();
  for (let corner = 0; corner < faces.length; corner += 3)
    for (let turn = 0; turn < 3; turn++) {
      const [one, two] = [faces[corner + turn]!, faces[corner + ((turn + 1) % 3)]!];
      if (inside[one] !== inside[two]) rim.add(inside[one] ? one : two);
    }
  return [...rim].sort((a, b) => a - b);
}

/** Return the mean of some vertices. */
export function middleOf(points: ArrayLike<number>, vertices: ArrayLike<number>): Vec3 {
  let sum: Vec3 = [0, 0, 0];
  for (const vertex of Array.from(vertices)) sum = add(sum, vertexOf(points, vertex));
  return scale(sum, 1 / Math.max(vertices.length, 1));
}

/** Return unit normals at the vertices, weighted by the areas of the faces. */
export function vertexNormals(points: Float32Array, faces: Uint32Array): Float32Array {
  const normals = new Float32Array(points.length);
  for (let face = 0; face < faces.length; face += 3) {
    const [a, b, c] = [3 * faces[face]!, 3 * faces[face + 1]!, 3 * faces[face + 2]!];
    const [x, y, z] = [points[a]!, points[a + 1]!, points[a + 2]!];
    const [ux, uy, uz] = [points[b]! - x, points[b + 1]! - y, points[b + 2]! - z];
    const [vx, vy, vz] = [points[c]! - x, points[c + 1]! - y, points[c + 2]! - z];
    const [nx, ny, nz] = [uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx];
    for (const corner of [a, b, c]) {
      normals[corner]! += nx;
      normals[corner + 1]! += ny;
      normals[corner + 2]! += nz;
    }
  }
  for (let place = 0; place < normals.length; place += 3) {
    const size = Math.hypot(normals[place]!, normals[place + 1]!, normals[place + 2]!) || 1;
    normals[place]! /= size;
    normals[place + 1]! /= size;
    normals[place + 2]! /= size;
  }
  return normals;
}
