import { expect, test } from "vitest";
import { History, type Step } from "../src/core/history";

/** A step that writes down what happens to it. */
const noted = (name: string, log: string[]): Step => ({
  undo: () => log.push(`undo ${name}`),
  redo: () => log.push(`redo ${name}`),
});

test("the last thing that the hand did is undone first, and all of it done again", async () => {
  const [history, log] = [new History(), [] as string[]];
  for (const name of ["stroke", "bend", "clear"]) history.did(noted(name, log));
  for (let i = 0; i < 4; i++) await history.go("undo", null);
  for (let i = 0; i < 4; i++) await history.go("redo", null);
  const undone = ["undo clear", "undo bend", "undo stroke"];
  expect(log).toEqual([...undone, "redo stroke", "redo bend", "redo clear"]);
});

test("what is done anew ends what could be done again", async () => {
  const [history, log] = [new History(), [] as string[]];
  history.did(noted("stroke", log));
  await history.go("undo", null);
  history.did(noted("box", log));
  expect(history.can("redo")).toBe(false);
});

test("edits of before a reload are undone, and done again in their place", async () => {
  const [history, log] = [new History(), [] as string[]];
  await history.go("undo", noted("edit", log));
  expect(history.can("redo")).toBe(true);
  await history.go("redo", null);
  expect(log).toEqual(["undo edit", "redo edit"]);
  history.forget();
  expect(history.can("undo")).toBe(false);
});
