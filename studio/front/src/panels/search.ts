/** Search: the shapes of an index that are most like this one or a painted part of it. */

import type { App, Panel } from "../contract";
import type { Match, Matches, State } from "../core/backend";
import type { Beside } from "../core/beside";
import { rgbOf } from "../core/colors";
import { Form, h, type NamedFile } from "../core/dom";
import markup from "./search.html?raw";

const [PART, TINT] = ["#e08a2e", 190]; // as the first region of Bend
const N_MATCHES = 12; // three on each row of the wall

/** What was searched with, which survives a reload. */
interface Asked {
  shape: number;
  region: number[] | null;
}

export class SearchPanel implements Panel {
  readonly id = "search";
  readonly title = "Search";
  readonly needs = ["query"];
  private app!: App;
  private readonly form = new Form(markup);
  private readonly list = this.form.get("matches");
  private found: Matches | null = null;
  private opened = -1; // match that is shown beside
  private shape = -1; // which the matches belong to
  private path = ""; // of the index
  private active = false;

  /** `painted` returns the vertices that are selected, if any are. */
  constructor(private readonly painted: () => Uint32Array) {}

  build(app: App): HTMLElement {
    this.app = app;
    this.form.on({
      search: () => this.search(null),
      "search-part": () => this.searchPart(),
      "search-file": async () => (await app.choose()).forEach((file) => this.searchFile(file)),
    });
    app.acceptDrops(this.form.root, (file) => this.searchFile(file));
    app.secondShown.push((second) => this.mark(second));
    return this.form.root;
  }

  refresh({ index, shape, beside }: State): void {
    const about = `${index!.n_shapes.toLocaleString("en")} shapes in ${index!.path}.`;
    const help = "A smaller score is more alike. Drop a file here to search with it.";
    this.form.text("index", `${about} ${help}`);
    if (shape !== this.shape || index!.path !== this.path) this.clear();
    [this.shape, this.path] = [shape, index!.path];
    if (!beside) this.opened = -1;
    this.list.querySelectorAll("li").forEach((card, i) => {
      card.classList.toggle("chosen", i === this.opened);
    });
  }

  /** What was found before a reload is found again; a search by a part follows what is painted. */
  shown(): void {
    this.active = true;
    const asked = this.app.settings.get<Asked | null>("search", null);
    const painted = this.painted();
    this.showPart(painted);
    if (asked?.shape !== this.shape) return;
    const other = asked.region && painted.length && painted.join() !== asked.region.join();
    if (other) this.search(painted);
    else if (!this.found) this.search(asked.region && Uint32Array.from(asked.region));
  }

  hidden(): void {
    this.active = false;
    this.showPart(new Uint32Array());
    this.app.viewer.setPoints([], PART);
  }

  private showPart(part: Uint32Array): void {
    const marks = new Uint8Array(4 * this.app.state.n_vertices);
    for (const vertex of part) marks.set([...rgbOf(PART), TINT], 4 * vertex);
    this.app.viewer.setMarks(marks);
  }

  /** The file becomes the shape, so that what is searched with is what is seen. */
  private async searchFile(file: NamedFile): Promise<void> {
    if (await this.app.openFile(file)) await this.search(null);
  }

  private searchPart(): void {
    const region = this.painted();
    if (region.length) this.search(region);
    else this.app.say("Paint a part first: choose Bend and its brush, and paint on the shape.");
  }

  private async search(region: Uint32Array | null): Promise<void> {
    const { app, form, list } = this;
    this.clear();
    const text = region ? "Searching for shapes with this part" : "Searching";
    const found = await app.run(text, app.backend.query(N_MATCHES, region));
    if (!found) return;
    this.found = found;
    app.settings.set("search", { shape: this.shape, region: region && [...region] } as Asked);
    list.replaceChildren(...found.matches.map((match, i) => this.buildCard(match, i)));
    const what = region ? "Shapes with a part like the painted one." : "Shapes like this one.";
    const itself = found.itself && ` The shape itself is there, too, as ${found.itself}.`;
    form.text("found", found.matches.length ? what + itself : "The index has no shape like this one.");
  }

  private clear(): void {
    [this.found, this.opened] = [null, -1];
    this.list.replaceChildren();
    this.form.text("found", "");
  }

  private buildCard({ name, label, score, mirrored }: Match, number: number): HTMLElement {
    const png = this.found!.arrays[`thumbnail${number}`] as Uint8Array<ArrayBuffer> | undefined;
    const src = URL.createObjectURL(new Blob(png ? [png] : [], { type: "image/png" }));
    const load = () => URL.revokeObjectURL(src);
    const picture = h("span", { class: "thumbnail" }, png && h("img", { src, alt: "", load }));
    const text = h(
      "span",
      {},
      h("b", {}, `${number + 1}. ${name}`),
      label && h("span", { class: "label" }, label),
      h("span", { class: "faint" }, `score ${score.toFixed(3)}${mirrored ? ", mirror image" : ""}`),
    );
    const title = `Show ${name} beside this shape, with corresponding points`;
    const click = () => this.openMatch(number);
    const attributes = { type: "button", title, "data-test": `match-${number}`, click };
    return h("li", {}, h("button", attributes, picture, text));
  }

  private async openMatch(number: number): Promise<void> {
    this.opened = number;
    await this.app.change({ kind: "beside", match: number }, "Loading the match");
  }

  /** Mark corresponding points of both shapes in the same colors. */
  private mark(second: Beside): void {
    const { app, found, opened } = this;
    if (!this.active || !found || opened < 0) return;
    const pairs = found.arrays[`pairs${opened}`] as Uint32Array;
    const colors = found.arrays[`colors${opened}`] as Uint8Array;
    [app.viewer, second.viewer].forEach((view, side) =>
      view.setPoints(
        pairs.filter((_, i) => i % 2 === side),
        colors,
      ),
    );
  }
}
