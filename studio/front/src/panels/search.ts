/** Search: the shapes of an index that are most like this one, and which points correspond. */

import type { App, Panel } from "../app";
import type { Match, Matches, State } from "../core/backend";
import { button, chooseFile, h } from "../core/dom";
import { Viewer } from "../core/viewer";
import { acceptDrops } from "./controls";
import { MESH_FILES } from "./shape";

const N_MATCHES = 10;

export class SearchPanel implements Panel {
  readonly id = "search";
  readonly title = "Search";
  readonly needs = ["query"];
  private app!: App;
  private readonly about = h("p", { class: "note", "data-test": "index" });
  private readonly list = h("ol", { class: "matches", "data-test": "matches" });
  private readonly beside = h("div", { class: "stage", "data-test": "beside" });
  private second: Viewer | null = null;
  private found: Matches | null = null;
  private shape = -1; // which the matches belong to

  build(app: App): HTMLElement {
    this.app = app;
    const search = button("Search with this shape", "search", "Compare with every shape of the index", () => this.search().catch(() => {}));
    search.classList.add("primary");
    const choose = () => chooseFile(MESH_FILES).then(({ name, bytes }) => this.searchFile(name, bytes));
    const file = button("With a file …", "search-file", "Open a mesh and search with it", choose);
    const page = h("div", { class: "search" }, this.about, h("div", { class: "row" }, search, file), this.list);
    acceptDrops(page, (name, bytes) => this.searchFile(name, bytes));
    return page;
  }

  refresh(state: State): void {
    const { index } = state;
    if (index) this.about.textContent = `${index.n_shapes.toLocaleString("en")} shapes in ${index.path}. A smaller score is more alike. Drop a file here to search with it.`;
    if (state.shape !== this.shape) this.clear();
  }

  hidden = (): void => this.closeMatch();

  /** The file becomes the shape, so that what is searched with is what is seen. */
  private searchFile(name: string, file: Uint8Array): void {
    const opened = this.app.change({ kind: "open", name, file }, `Reading ${name}`);
    opened.then(() => this.search()).catch(() => {}); // the status line has said what failed
  }

  private async search(): Promise<void> {
    this.clear();
    this.found = await this.app.run("Searching", this.app.backend.query({ n_matches: N_MATCHES }));
    this.shape = this.app.state.shape;
    this.list.replaceChildren(...this.found.matches.map((match, i) => this.buildCard(match, i)));
    if (!this.found.matches.length) this.list.append("The index has no shape like this one.");
  }

  private clear(): void {
    this.closeMatch();
    this.list.replaceChildren();
  }

  private buildCard(match: Match, number: number): HTMLElement {
    const bytes = (this.found!.arrays[`thumbnail${number}`]?.data ?? new Uint8Array()) as Uint8Array<ArrayBuffer>;
    const src = URL.createObjectURL(new Blob([bytes], { type: "image/png" }));
    const image = h("img", { src, alt: "", onload: () => URL.revokeObjectURL(src) });
    const picture = h("span", { class: "thumbnail" }, bytes.length > 0 && image);
    const label = match.label && h("span", { class: "label" }, match.label);
    const score = h("span", { class: "faint" }, `score ${match.score.toFixed(3)}`);
    const text = h("span", {}, h("b", {}, `${number + 1}. ${match.name}`), label, score);
    const open = () => this.openMatch(number).catch((error) => this.app.fail(error));
    const title = `Show ${match.name} beside this shape, with corresponding points`;
    return h("li", {}, h("button", { type: "button", title, "data-test": `match-${number}`, onclick: open }, picture, text));
  }

  /** Show a match in a second view, and corresponding points of both in the same colors. */
  private async openMatch(number: number): Promise<void> {
    const { app, found } = this;
    const { backend, state, viewer } = app;
    const names = [`match/${number}/vertices`, `match/${number}/faces`, "vertices"];
    const arrays = await app.run("Loading the match", Promise.all(names.map((name) => backend.array(name))));
    const [vertices, faces, own] = arrays.map(({ data }) => data);
    if (found !== this.found) return;
    const { name, up = state.up, front = state.front } = found!.matches[number]!;
    this.closeMatch();
    const stage = viewer.stage;
    stage.after(this.beside);
    stage.parentElement!.classList.add("compare");
    this.second = new Viewer(this.beside);
    const close = button("Close", "close-match", "Close the match", () => this.closeMatch());
    this.beside.append(h("div", { class: "caption" }, name, close));
    this.second.setMesh(vertices as Float32Array, faces as Uint32Array, up, front);
    viewer.fit();
    const pairs = found!.arrays[`pairs${number}`]?.data ?? new Uint32Array();
    const [here, there] = [0, 1].map((side) => pairs.filter((_, i) => i % 2 === side) as Uint32Array);
    const colors = colorByPlace(own as Float32Array, here!);
    viewer.setPoints(here!, colors);
    this.second.setPoints(there!, colors);
    [...this.list.children].forEach((card, i) => card.classList.toggle("chosen", i === number));
  }

  private closeMatch(): void {
    if (!this.second) return;
    this.second.dispose();
    this.second = null;
    this.beside.remove();
    this.beside.replaceChildren();
    this.app.viewer.stage.parentElement!.classList.remove("compare");
    this.app.viewer.setPoints([], "red");
    for (const card of this.list.children) card.classList.remove("chosen");
  }
}

/** Neighboring points have similar colors, so that a swapped limb is seen at a glance. */
function colorByPlace(points: Float32Array, vertices: Uint32Array): string[] {
  const channels = [0, 1, 2].map((axis) => {
    const places = Array.from(vertices, (vertex) => points[3 * vertex + axis]!);
    const [low, high] = [Math.min(...places), Math.max(...places)];
    return places.map((place) => Math.round(40 + (215 * (place - low)) / (high - low || 1)));
  });
  return Array.from(vertices, (_, i) => `rgb(${channels.map((channel) => channel[i]).join(", ")})`);
}
