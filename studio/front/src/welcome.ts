/** The first page where no file was opened: drop one, or try a sample. */

import type { App } from "./contract";
import { h, isTouch, pictureOf } from "./core/dom";

const TITLES: Record<string, string> = { quadruped: "Animal", biped: "Person", hand: "Hand" };

/** Show a card over the picture until a shape is chosen. */
export function welcome(app: App): void {
  const { samples } = app.state;
  const close = () => {
    app.settings.set("welcomed", true);
    card.remove();
  };
  const opened = async (work: Promise<boolean>) => {
    if (!(await work)) return;
    close();
  };
  const choose = async () => {
    const [file] = await app.choose();
    if (file) opened(app.openFile(file));
  };
  const trySample = async (sample: string) => {
    close();
    // The first of them is there already.
    if (sample !== app.state.name) await app.change({ kind: "open", sample }, "Opening a sample");
    app.firstTour();
  };
  const buttons = samples.map((sample) => {
    const attributes = { type: "button", "data-test": `sample-${sample}`, click: () => trySample(sample) };
    const button = h("button", attributes, TITLES[sample] ?? sample);
    const picture = app.backend.array<Uint8Array<ArrayBuffer>>(`sample/${sample}`);
    picture.then((png) => button.prepend(pictureOf(png))).catch((error) => app.fail(error));
    return button;
  });
  const open = { type: "button", class: "primary", "data-test": "welcome-open", click: choose };
  const showFolders = () => opened(app.folders.show());
  const openFolder = { type: "button", "data-test": "welcome-folder", click: showFolders };
  const card = h(
    "section",
    { class: "welcome", "data-test": "welcome", "aria-label": "Open a shape" },
    h("h2", {}, isTouch() ? "Open a 3D file" : "Drop a 3D file here"),
    h("p", { class: "note" }, app.state.suffixes.split(",").slice(0, 6).join("  "), " and others"),
    h("button", open, "Choose a file …"),
    app.state.capabilities.includes("folders") && h("button", openFolder, "A folder …"),
    h("p", {}, "or try a sample"),
    h("div", { class: "samples" }, ...buttons),
  );
  app.acceptDrops(card, (file) => opened(app.openFile(file)));
  app.viewer.stage.append(card);
}
