import { expect, test } from "vitest";
import { backendOver, type Send } from "../src/core/backend";
import { decode, encode, type TypedArray } from "../src/core/wire";

const arrays: Record<string, TypedArray> = {
  a: Float32Array.of(1.5, -0),
  b: Float64Array.of(Math.PI),
  c: Uint32Array.of(4294967295, 1, 2),
  d: Int32Array.of(-7),
  e: Uint8Array.of(1, 2, 3),
  empty: new Float32Array(0),
};

test("messages come back as they were, and arrays begin at multiples of 8", () => {
  const meta = { name: "größe ∞", list: [1, null, true] };
  const message = encode(meta, arrays);
  const found = decode(message);
  expect(found.meta).toEqual(meta);
  for (const [name, array] of Object.entries(arrays)) {
    expect(found.arrays[name]).toEqual(array);
    expect(found.arrays[name]!.byteOffset % 8).toBe(0);
  }
});

test("a message may begin anywhere in a larger buffer", () => {
  const message = encode({}, arrays);
  const larger = new Uint8Array(message.length + 3);
  larger.set(message, 3);
  expect(decode(larger.subarray(3)).arrays.b![0]).toBe(Math.PI);
});

test("the bytes are those of the specification", () => {
  const message = encode({ x: 1 }, { v: Uint32Array.of(7) });
  const size = new DataView(message.buffer).getUint32(0, true);
  const header = JSON.parse(new TextDecoder().decode(message.subarray(4, 4 + size)));
  expect((4 + size) % 8).toBe(0);
  expect(header).toEqual({ meta: { x: 1 }, arrays: { v: { dtype: "<u4", shape: [1], offset: 0 } } });
  expect([...message.subarray(4 + size)]).toEqual([7, 0, 0, 0, 0, 0, 0, 0]);
});

test("damaged messages are refused", () => {
  const message = encode({}, arrays);
  expect(() => decode(message.subarray(0, 2))).toThrow(RangeError);
  expect(() => decode(message.subarray(0, 20))).toThrow("header");
  expect(() => decode(message.slice(0, message.length - 16))).toThrow(RangeError);
});

test("half precision comes as single precision, times its scale", () => {
  const halves = Uint16Array.of(0x3c00, 0xc000, 0x3555, 0x0001, 0x7bff); // 1, -2, 1/3, 2^-24, 65504
  const entry = { dtype: "<f2", shape: [5], scale: 3, offset: 0 };
  const header = JSON.stringify({ meta: {}, arrays: { h: entry } }).padEnd(92);
  const message = new Uint8Array(96 + halves.byteLength);
  message.set(new TextEncoder().encode(header), 4);
  message.set(new Uint8Array(halves.buffer), 96);
  message[0] = 92;
  const found = decode(message).arrays.h!;
  expect(found).toBeInstanceOf(Float32Array);
  [3, -6, 1, 3 * 2 ** -24, 3 * 65504].forEach((value, i) => expect(found[i]! / value).toBeCloseTo(1, 3));
});

test("calls become messages, and errors of the library are thrown", async () => {
  const seen: unknown[] = [];
  const send: Send = async (call, message) => {
    seen.push([call, decode(message).meta, Object.keys(decode(message).arrays)]);
    if (call === "rig") return encode({ n_modes: [8], seconds: 0 }, { shares: Float32Array.of(0, 1) });
    return encode({ error: { kind: "InvalidParameterError", message: "A region is empty." } });
  };
  const backend = backendOver(send);
  const regions = [Uint32Array.of(1), Uint32Array.of(2)];
  const answer = await backend.rig({ n_modes: null, regions, fixed: Uint32Array.of(0) });
  expect([...answer.shares]).toEqual([0, 1]);
  expect(seen[0]).toEqual(["rig", { n_modes: null, n_regions: 2, fixed: true }, ["region0", "region1", "fixed"]]);
  await expect(backend.finish({ kind: "undo" })).rejects.toThrow("A region is empty.");
});
