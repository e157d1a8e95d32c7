import { expect, test } from "vitest";
import { type Backend, backendOver } from "../src/core/backend";
import { decode, encode } from "../src/core/wire";

/** A server that answers each call when it is told to. */
function slowServer() {
  const asked: { call: keyof Backend; meta: any; answer: (meta: unknown) => void }[] = [];
  const backend = backendOver(
    (call, message) =>
      new Promise((done) => {
        asked.push({ call, meta: decode(message).meta, answer: (meta) => done(encode(meta)) });
      }),
  );
  return { backend, asked };
}

const settle = () => new Promise((done) => setTimeout(done));
const bind = (vertex: number) => ({
  n_modes: null,
  regions: [Uint32Array.of(vertex)],
  fixed: null,
});

test("of two regions that are bound in a hurry, the last is the one that moves", async () => {
  const { backend, asked } = slowServer();
  const answers = [backend.rig(bind(0)), backend.rig(bind(1)), backend.finish({ kind: "commit" })];
  await settle();
  expect(asked.length).toBe(1); // a second one could overtake it
  asked[0]!.answer({});
  await settle();
  expect(asked.map(({ call }) => call)).toEqual(["rig", "rig"]);
  asked[1]!.answer({ error: { message: "the region is empty" } });
  await expect(answers[1]).rejects.toThrow("the region is empty");
  await settle();
  expect(asked[2]!.meta.kind).toBe("commit"); // an error does not stop what comes after it
  asked[2]!.answer({});
  await answers[2];
});

test("what only reads waits for nothing", async () => {
  const { backend, asked } = slowServer();
  backend.rig(bind(0));
  const state = backend.meta();
  await settle();
  expect(asked.map(({ call }) => call).sort()).toEqual(["meta", "rig"]);
  asked.find(({ call }) => call === "meta")!.answer({ name: "ball" });
  expect((await state).name).toBe("ball");
});
