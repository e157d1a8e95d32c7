/** Search: the shapes of an index that are most like this one, and which points correspond. */

import type { Panel, Studio } from "../app";
import type { Match, Matches, State } from "../core/backend";
import { Form, h, type NamedFile } from "../core/dom";
import { Viewer } from "../core/viewer";
import markup from "./search.html?raw";

const N_MATCHES = 10;

export class SearchPanel implements Panel {
  readonly id = "search";
  readonly title = "Search";
  readonly needs = ["query"];
  private app!: Studio;
  private readonly form = new Form(markup);
  private readonly list = this.form.get("matches");
  private readonly beside = h("div", { class: "stage", "data-test": "beside" });
  private second: Viewer | null = null;
  private found: Matches | null = null;
  private shape = -1; // which the matches belong to

  build(app: Studio): HTMLElement {
    this.app = app;
    this.form.on({
      search: () => this.search(),
      "search-file": async () => (await app.choose()).forEach((file) => this.searchFile(file)),
    });
    app.acceptDrops(this.form.root, (file) => this.searchFile(file));
    return this.form.root;
  }

  refresh({ index, shape }: State): void {
    const about = `${index!.n_shapes.toLocaleString("en")} shapes in ${index!.path}.`;
    const help = "A smaller score is more alike. Drop a file here to search with it.";
    this.form.text("index", `${about} ${help}`);
    if (shape !== this.shape) this.clear();
  }

  hidden(): void {
    this.closeMatch();
  }

  /** The file becomes the shape, so that what is searched with is what is seen. */
  private async searchFile(file: NamedFile): Promise<void> {
    if (await this.app.openFile(file)) await this.search();
  }

  private async search(): Promise<void> {
    this.clear();
    this.found = await this.app.run("Searching", this.app.backend.query(N_MATCHES));
    if (!this.found) return;
    this.shape = this.app.state.shape;
    this.list.replaceChildren(...this.found.matches.map((match, i) => this.buildCard(match, i)));
    if (!this.found.matches.length) this.list.append("The index has no shape like this one.");
  }

  private clear(): void {
    this.closeMatch();
    this.list.replaceChildren();
  }

  private buildCard({ name, label, score }: Match, number: number): HTMLElement {
    const png = this.found!.arrays[`thumbnail${number}`] as Uint8Array<ArrayBuffer> | undefined;
    const src = URL.createObjectURL(new Blob(png ? [png] : [], { type: "image/png" }));
    const load = () => URL.revokeObjectURL(src);
    const picture = h("span", { class: "thumbnail" }, png && h("img", { src, alt: "", load }));
    const text = h(
      "span",
      {},
      h("b", {}, `${number + 1}. ${name}`),
      label && h("span", { class: "label" }, label),
      h("span", { class: "faint" }, `score ${score.toFixed(3)}`),
    );
    const title = `Show ${name} beside this shape, with corresponding points`;
    const click = () => this.openMatch(number);
    const attributes = { type: "button", title, "data-test": `match-${number}`, click };
    return h("li", {}, h("button", attributes, picture, text));
  }

  /** Show a match in a second view, and corresponding points of both in the same colors. */
  private async openMatch(number: number): Promise<void> {
    const { app, found } = this;
    const { backend, state, viewer } = app;
    const loading = Promise.all([
      backend.array<Float32Array>(`match/${number}/vertices`),
      backend.array<Uint32Array>(`match/${number}/faces`),
    ]);
    const loaded = await app.run("Loading the match", loading);
    if (!loaded || !found || found !== this.found) return;
    const { name, up = state.up, towards = state.towards } = found.matches[number]!;
    this.closeMatch();
    viewer.stage.after(this.beside);
    viewer.stage.parentElement!.classList.add("compare");
    this.second = new Viewer(this.beside);
    const click = () => this.closeMatch();
    const close = { type: "button", "data-test": "close-match", title: "Close the match", click };
    const caption = h("div", { class: "caption" }, name, h("button", close, "Close"));
    this.beside.append(caption);
    this.second.setMesh(...loaded, up, towards);
    viewer.fit();
    const pairs = found.arrays[`pairs${number}`] as Uint32Array;
    const colors = found.arrays[`colors${number}`] as Uint8Array;
    [viewer, this.second].forEach((view, side) =>
      view.setPoints(
        pairs.filter((_, i) => i % 2 === side),
        colors,
      ),
    );
    [...this.list.children].forEach((card, i) => card.classList.toggle("chosen", i === number));
  }

  private closeMatch(): void {
    if (!this.second) return;
    this.second.dispose();
    this.second = null;
    this.beside.remove();
    this.beside.replaceChildren();
    this.app.viewer.stage.parentElement!.classList.remove("compare");
    this.app.viewer.setPoints([], "#000000");
    for (const card of this.list.children) card.classList.remove("chosen");
  }
}
