import { expect, test } from "vitest";
import type { Handle, Vec3 } from "../src/core/backend";
import { selectBox, Surface } from "../src/core/geodesic";
import { add, carry, cross, dot, length, regionBoundary, rotationFromDrag, scale, subtract, vertexNormals, vertexOf } from "../src/core/motion";
import { FIXED, Regions } from "../src/core/regions";
import cases from "./cases.json";

const { deformation } = cases;
const vertices = deformation.vertices;
const faces = Uint32Array.from(deformation.faces);
const sorted = (numbers: Iterable<number>) => [...numbers].sort((a, b) => a - b);

function expectClose(found: number[], wanted: number[], digits = 10) {
  expect(found.length).toBe(wanted.length);
  found.forEach((value, place) => expect(value).toBeCloseTo(wanted[place]!, digits));
}

test("a box selects the vertices that numpy selects, its faces included", () => {
  const { low, high, vertices: wanted } = deformation.box;
  expect([...selectBox(vertices, low as Vec3, high as Vec3)]).toEqual(wanted);
  expect([...selectBox([1, 1, 1, 2, 2, 2], [1, 1, 1], [1, 1, 1])]).toEqual([0]);
});

test.each(deformation.brushes)("a brush of radius $radius selects what numpy selects", (brush) => {
  const surface = new Surface(vertices, faces);
  expect(sorted(surface.disc(brush.vertex, brush.radius))).toEqual(brush.vertices);
  // The second wave must find no trace of the first.
  expect(sorted(surface.disc(brush.vertex, brush.radius))).toEqual(brush.vertices);
});

test("a wave crosses flat triangles in a straight line", () => {
  // A unit square with its diagonal from 1 to 2: vertex 3 is √2 from vertex 0, through the diagonal.
  const square = new Surface([0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0], Uint32Array.of(0, 1, 2, 1, 3, 2));
  expect(square.disc(0, 1.414)).toEqual([0, 1, 2]);
  expect(square.disc(0, 1.4143)).toEqual([0, 1, 2, 3]);
});

test("the rim of a region is that of numpy", () => {
  const inside = new Uint8Array(vertices.length / 3);
  for (const vertex of deformation.box.vertices) inside[vertex] = 1;
  expect(regionBoundary(faces, inside)).toEqual(deformation.rim);
});

test("shares of a motion move vertices as numpy does", () => {
  const { rotation, translation, shares } = deformation;
  const moved = (handle: Handle) =>
    shares.flatMap((share, vertex) => {
      const point = vertexOf(vertices, vertex);
      return add(point, carry(handle, point, share));
    });
  expectClose(moved({ type: "rotation", ...rotation } as Handle), deformation.rotated);
  expectClose(moved({ type: "translation", ...translation } as Handle), deformation.translated);
});

test("half of a turn by 180° is a quarter turn, and keeps the distance to the axis", () => {
  const turn: Handle = { type: "rotation", pivot: [1, 0, 0], axis: [0, 0, 1], angle: Math.PI };
  expectClose(add([3, 0, 5], carry(turn, [3, 0, 5], 0.5)), [1, 2, 5]);
  expectClose(add([3, 0, 5], carry(turn, [3, 0, 5], 1)), [-1, 0, 5]);
  expect(carry(turn, [3, 0, 5], 0)).toEqual([0, 0, 0]);
  expect(carry(null, [3, 0, 5], 1)).toEqual([0, 0, 0]);
});

test.each(deformation.drags)("a drag turns as rotation_from_drag does", ({ points, axis, angle }) => {
  const [pivot, start, end] = points as [Vec3, Vec3, Vec3];
  const turn = rotationFromDrag(pivot, start, end)!;
  if (turn.type !== "rotation") throw new Error("not a rotation");
  expectClose([...turn.axis, turn.angle], [...axis, angle]);
  const moved = subtract(add(start, carry(turn, start, 1)), pivot);
  const arm = subtract(end, pivot);
  expect(length(cross(moved, arm)) / length(moved) / length(arm)).toBeCloseTo(0, 12);
  expect(dot(moved, arm)).toBeGreaterThan(0);
});

test("a drag without a direction gives no rotation", () => {
  expect(rotationFromDrag([0, 0, 0], [1, 0, 0], [-2, 0, 0])).toBeNull(); // opposite: many axes
  expect(rotationFromDrag([0, 0, 0], [0, 0, 0], [1, 0, 0])).toBeNull(); // the pivot itself
  expect(rotationFromDrag([0, 0, 0], [1, 0, 0], [3, 0, 0])).toMatchObject({ angle: 0 });
});

test("normals have length 1 and point out of the sphere", () => {
  const normals = vertexNormals(Float32Array.from(vertices), faces);
  for (let vertex = 0; vertex < vertices.length / 3; vertex++) {
    const normal = vertexOf(normals, vertex);
    expect(length(normal)).toBeCloseTo(1, 6);
    expect(dot(normal, scale(vertexOf(vertices, vertex), 1))).toBeGreaterThan(0);
  }
});

test("regions stay disjoint, and survive as text", () => {
  const regions = new Regions(10);
  regions.add(0, [1, 2, 3, 4]);
  regions.add(1, [4, 5]);
  regions.add(FIXED, [9]);
  regions.remove(0, [1, 5]); // vertex 5 belongs to another region
  expect([0, 1, FIXED].map((region) => [...regions.vertices(region)])).toEqual([[2, 3], [4, 5], [9]]);
  expect([regions.of(0), regions.of(4), regions.of(9)]).toEqual([null, 1, FIXED]);
  const copy = new Regions(10);
  copy.read(regions.write());
  expect(copy.write()).toBe(regions.write());
  const other = new Regions(11); // of another mesh
  other.read(regions.write());
  expect([...other.vertices(0)]).toEqual([]);
  regions.clear(1);
  expect([...regions.mask(1)]).toEqual(Array(10).fill(0));
});
