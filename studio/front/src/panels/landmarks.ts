/** Landmarks: named points that are placed, moved, saved, and carried to the second shape. */

import type { App, Panel } from "../contract";
import type { Landmark, State } from "../core/backend";
import { partColors } from "../core/colors";
import { download, Form, h, type NamedFile } from "../core/dom";
import type { Hit } from "../core/viewer";
import markup from "./landmarks.html?raw";

const FORMATS = ".mrk.json,.json,.fcsv,.csv,.tps,.txt,.nts,.dta,.pts,.pp,.landmarkAscii";

export class LandmarksPanel implements Panel {
  readonly id = "landmarks";
  readonly title = "Landmarks";
  readonly needs = ["beside"];
  private app!: App;
  private readonly form = new Form(markup);
  private active = false;
  private placing = false;
  private moving = -1; // row of the landmark that the next click moves
  private shownAs = ""; // what the list shows

  build(app: App): HTMLElement {
    const { form } = this;
    this.app = app;
    form.on({
      place: () => this.place(!this.placing),
      "load-landmarks": async () => (await app.choose(FORMATS)).forEach((file) => this.load(file)),
    });
    app.acceptDrops(form.root, (file) => this.load(file));
    app.shortcut("L", "Landmarks: place points", () => {
      app.open(this.id);
      this.place(true);
    });
    for (const button of form.root.querySelectorAll<HTMLElement>("[data-ending]"))
      button.addEventListener("click", () =>
        this.save(button.dataset.side!, button.dataset.ending!),
      );
    return form.root;
  }

  refresh({ landmarks, beside }: State): void {
    const { form } = this;
    const mapped = beside?.map.status === "ready";
    form.get("save-0").hidden = !landmarks.length;
    form.get("save-1").hidden = !landmarks.length || !mapped;
    form.text("carried", beside ? `Carried to ${beside.name} by the map.` : "");
    const names = JSON.stringify(landmarks.map(({ name }) => name));
    if (names !== this.shownAs) this.list(landmarks);
    this.shownAs = names;
    this.hint();
    if (this.active) this.draw();
  }

  shown(): void {
    this.active = true;
    this.draw();
  }

  hidden(): void {
    this.place(false);
    this.active = false;
    for (const view of this.views()) view.setPoints([], "#000000");
  }

  private views() {
    return [this.app.viewer, this.app.second?.viewer].filter((view) => !!view);
  }

  private get landmarks(): Landmark[] {
    return this.app.state.landmarks;
  }

  /** Let clicks place points, or end that. */
  private place(placing: boolean): void {
    [this.placing, this.moving] = [placing, -1];
    this.form.get("place").setAttribute("aria-pressed", String(placing));
    this.point();
  }

  /** Give the pointer to what a click does. */
  private point(): void {
    const clicks = this.placing || this.moving >= 0;
    this.app.viewer.setPointer(
      clicks ? "crosshair" : "grab",
      clicks ? (hit) => this.take(hit) : null,
    );
    this.hint();
  }

  private hint(): void {
    const name = this.landmarks[this.moving]?.name;
    const place = this.placing ? "Click the shape where a point should be." : "";
    this.form.text("place-hint", name ? `Click the new place of ${name}.` : place);
  }

  private take({ point }: Hit): void {
    const { landmarks, moving } = this;
    if (moving >= 0) {
      this.moving = -1;
      this.point();
      this.change(landmarks.map((each, row) => (row === moving ? { ...each, point } : each)));
    } else this.change([...landmarks, { name: this.freeName(), point, vertex: -1 }]);
  }

  private freeName(): string {
    const names = new Set(this.landmarks.map(({ name }) => name));
    let number = names.size + 1;
    while (names.has(String(number))) number++;
    return String(number);
  }

  /** Take other landmarks; if they are refused, the list shows again those that are. */
  private async change(landmarks: Landmark[]): Promise<void> {
    const points = Float64Array.from(landmarks.flatMap(({ point }) => point));
    const change = { kind: "landmarks", names: landmarks.map(({ name }) => name) };
    if (!(await this.app.change(change, "Placing landmarks", { points }))) this.list(this.landmarks);
  }

  private async load({ name, bytes }: NamedFile): Promise<void> {
    await this.app.change({ kind: "landmarks", name }, `Reading ${name}`, { file: bytes });
  }

  private async save(side: string, ending: string): Promise<void> {
    const { app } = this;
    const name = `landmarks/${side}/${ending}`;
    const file = await app.load<Uint8Array<ArrayBuffer>>(name, "Writing the file");
    const stem = side === "0" ? app.state.name : app.state.beside!.name;
    if (file) download(file, `${stem.replace(/\.\w{2,4}$/, "")}.${ending}`);
  }

  private list(landmarks: Landmark[]): void {
    const colors = partColors(landmarks.length);
    const rows = landmarks.map(({ name }, row) => {
      const move = () => {
        this.moving = row;
        this.point();
      };
      const rename = ({ target }: Event) =>
        this.change(
          landmarks.map((each, i) =>
            i === row ? { ...each, name: (target as HTMLInputElement).value.trim() } : each,
          ),
        );
      const remove = () => this.change(landmarks.filter((_, i) => i !== row));
      const swatch = h("span", { class: "dot" });
      swatch.style.background = `rgb(${colors.subarray(3 * row, 3 * row + 3).join()})`;
      const label = `Name of landmark ${row + 1}`;
      const input = { type: "text", value: name, "aria-label": label, change: rename };
      const button = (text: string, title: string, click: () => void) =>
        h("button", { type: "button", title, "aria-label": title, click }, text);
      return h(
        "li",
        { "data-test": `landmark-${row}` },
        swatch,
        h("input", input),
        button("Move", `Move ${name}`, move),
        button("×", `Remove ${name}`, remove),
      );
    });
    this.form.get("landmarks").replaceChildren(...rows);
  }

  /** Mark the landmarks on this shape, and on the second one if there is a map. */
  private async draw(): Promise<void> {
    const { app, landmarks } = this;
    const colors = partColors(landmarks.length);
    app.viewer.setPoints(
      landmarks.map(({ vertex }) => vertex),
      colors,
    );
    const second = app.second;
    if (!second?.viewer.vertices.length) return;
    if (app.state.beside?.map.status !== "ready") return second.viewer.setPoints([], "#000000");
    const carried = landmarks.length
      ? await app.backend.array<Int32Array>("landmarks/1/vertices")
      : new Int32Array();
    if (!this.active || second !== app.second || carried.length !== this.landmarks.length) return;
    const known = [...carried.keys()].filter((row) => carried[row]! >= 0);
    second.viewer.setPoints(
      known.map((row) => carried[row]!),
      Uint8Array.from(known.flatMap((row) => [...colors.subarray(3 * row, 3 * row + 3)])),
    );
  }
}
