/** The tour: in twenty seconds it bends a limb, turns the view, and says what else there is. */

import type { App } from "./contract";
import type { Vec3 } from "./core/backend";
import { h, isTouch } from "./core/dom";
import type { Limbs } from "./panels/deform/limbs";

const BEND = 0.7; // radians
const TOUCH = "Tap “Finger: turns” above; then drag it, and it bends.";
const LOOK = 0.5; // radians by which the view turns

/** Wait for frames until a time has passed, and say at each which share of it; stop where asked. */
async function play(ms: number, signal: AbortSignal, act: (share: number) => void): Promise<void> {
  const begin = performance.now();
  for (let share = 0; share < 1; ) {
    await new Promise(requestAnimationFrame);
    signal.throwIfAborted();
    share = Math.min((performance.now() - begin) / ms, 1);
    act(share);
  }
}

/** Run the tour; a click, Escape or its button ends it. Nothing of it is kept. */
export async function runTour(app: App, limbs: Limbs): Promise<void> {
  const { viewer } = app;
  const { stage } = viewer;
  const stop = new AbortController();
  const { signal } = stop;
  const text = h("span", { role: "status" });
  const skip = { type: "button", "data-test": "tour-skip", click: () => stop.abort() };
  const bar = h("div", { class: "tour", "data-test": "tour-bar" }, text, h("button", skip, "Skip"));
  const hand = h("div", { class: "tour-hand", hidden: true });
  const tabs = app.main.querySelector(".tabs")!;
  stage.append(bar, hand);
  const options = { capture: true, signal };
  viewer.canvas.addEventListener("pointerdown", () => stop.abort(), options);
  window.addEventListener("keydown", ({ key }) => key === "Escape" && stop.abort(), options);
  const say = (words: string) => (text.textContent = words);
  const wave = (share: number) => Math.sin(Math.PI * share) ** 2; // forth and back
  try {
    say("The shape is being prepared …");
    while (!limbs.farthest()) await play(200, signal, () => {});
    const limb = limbs.farthest()!;
    const [from, to] = [[0.5 * stage.clientWidth, 0.9 * stage.clientHeight], viewer.placeOf(limb.tip)];
    const show = ([x, y]: number[]) =>
      Object.assign(hand.style, { left: `${x}px`, top: `${y}px` });
    hand.hidden = false;
    say(isTouch() ? "These are its limbs." : "Point at a limb: it lights up.");
    await play(2500, signal, (share) => show(from.map((each, i) => each + share * (to[i]! - each))));
    limbs.light(limb.number);
    await play(1500, signal, () => {});
    say(isTouch() ? TOUCH : "Drag it, and it bends. Ctrl+Z takes it back.");
    await limbs.hold(limb.number, limb.tip);
    const axis = viewer.axes.towards.toArray() as Vec3;
    const pivot = limbs.pivot.toArray() as Vec3;
    await play(6000, signal, (share) => {
      viewer.setHandles([{ type: "rotation", pivot, axis, angle: BEND * wave(share) }]);
      show(viewer.placeOf(limbs.turned(limb.tip, axis, BEND * wave(share))));
    });
    limbs.light(-1);
    hand.hidden = true;
    say(isTouch() ? "One finger turns the view, two zoom." : "Drag anywhere else, and the view turns. The wheel zooms.");
    let before = 0;
    await play(5000, signal, (share) => {
      viewer.controls.rotateLeft(LOOK * (wave(share) - before));
      before = wave(share);
    });
    say("Here are its measures, its vibrations, its heat and its parts.");
    tabs.classList.add("shown");
    await play(5000, signal, () => {});
  } catch (error) {
    if (!signal.aborted) throw error;
  } finally {
    stop.abort();
    limbs.light(-1);
    viewer.setHandles([]);
    tabs.classList.remove("shown");
    bar.remove();
    hand.remove();
  }
}
