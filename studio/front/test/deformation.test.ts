import { Vector3 } from "three";
import { expect, test } from "vitest";
import type { Handle } from "../src/core/backend";
import { FIXED, Regions } from "../src/core/regions";
import { rotationFromDrag } from "../src/core/tools";
import { reflect } from "../src/panels/deform/limbs";
import cases from "./cases.json";

const { drags } = cases.deformation;
const point = (numbers: number[]) => new Vector3(...(numbers as [number, number, number]));

test.each(drags)("a drag turns as rotation_from_drag does", ({ points, axis, angle }) => {
  const [pivot, start, end] = points.map(point) as [Vector3, Vector3, Vector3];
  const turn = rotationFromDrag(pivot, start, end)!;
  if (turn.type !== "rotation") throw new Error("not a rotation");
  [...turn.axis, turn.angle].forEach((value, i) => expect(value).toBeCloseTo([...axis, angle][i]!, 10));
  const moved = start.clone().sub(pivot).applyAxisAngle(point(turn.axis), turn.angle);
  expect(moved.angleTo(end.clone().sub(pivot))).toBeCloseTo(0, 7);
});

test("a drag without a direction gives no rotation", () => {
  const [pivot, along] = [point([0, 0, 0]), point([1, 0, 0])];
  expect(rotationFromDrag(pivot, along, point([-2, 0, 0]))).toBeNull(); // opposite: many axes
  expect(rotationFromDrag(pivot, pivot, along)).toBeNull(); // the pivot itself
  expect(rotationFromDrag(pivot, along, point([3, 0, 0]))).toMatchObject({ angle: 0 });
});

test.each([0, 1, 2])("a mirrored motion moves a mirrored point to the mirror image", (mirror) => {
  const flip = (vector: Vector3) => vector.clone().setComponent(mirror, -vector.getComponent(mirror));
  const [start, pivot, axis] = [point([0.3, -0.7, 0.2]), point([0.1, 0.2, -0.4]), point([0.48, 0.6, 0.64])];
  const turned = (at: Vector3, from: Vector3, about: Vector3) =>
    at.clone().sub(from).applyAxisAngle(about, 0.8).add(from);
  const turn: Handle = { type: "rotation", pivot: pivot.toArray(), axis: axis.toArray(), angle: 0.8 };
  const image = reflect(turn, flip(pivot).toArray(), mirror)!;
  if (image.type !== "rotation") throw new Error("not a rotation");
  const end = turned(flip(start), point(image.pivot), point(image.axis));
  expect(end.distanceTo(flip(turned(start, pivot, axis)))).toBeCloseTo(0, 12);
  const shift = reflect({ type: "translation", vector: [1, 2, 3] }, [0, 0, 0], mirror);
  const scaling: Handle = { type: "scaling", pivot: [9, 9, 9], factors: [1, 2, 3] };
  expect(reflect(scaling, [0, 0, 1], mirror)).toEqual({ ...scaling, pivot: [0, 0, 1] });
  expect(shift).toEqual({ type: "translation", vector: flip(point([1, 2, 3])).toArray() });
});

test("regions stay disjoint, and the server can keep them", () => {
  const regions = new Regions(10);
  regions.add(0, [1, 2, 3, 4]);
  regions.add(1, [4, 5]);
  regions.add(FIXED, [9]);
  regions.remove(0, [1, 5]); // vertex 5 belongs to another region
  expect([0, 1, FIXED].map((region) => [...regions.vertices(region)])).toEqual([[2, 3], [4, 5], [9]]);
  expect([regions.of(0), regions.of(4), regions.of(9)]).toEqual([null, 1, FIXED]);
  const copy = new Regions(10);
  copy.read(regions.owners);
  expect(copy.owners).toEqual(regions.owners);
  copy.read(new Uint8Array()); // the server has none
  expect([...copy.vertices(0)]).toEqual([]);
  regions.clear(1);
  expect([...regions.vertices(1)]).toEqual([]);
});
