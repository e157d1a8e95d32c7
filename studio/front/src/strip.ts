/** The strip over the picture: whole shape, edges, cut, ruler, films, and what a finger does. */

import { Vector3 } from "three";
import type { App } from "./contract";
import { nearestAxis } from "./core/axes";
import { download, Form, h } from "./core/dom";
import { playFilm, saveGif, turntable, type Film } from "./core/film";
import { Ruler } from "./core/ruler";
import markup from "./strip.html?raw";

// Keys, the buttons that they press, and what these do; the views have the keys that Blender gives them.
const KEYS: [string, string, string?][] = [
  ["E", "edges"],
  ["X", "cut"],
  ["M", "measure"],
  ["F", "film"],
  ["I", "texture"],
  ["1", "view-front", "the front, orthographic"],
  ["3", "view-right", "the right side, orthographic"],
  ["7", "view-top", "from above, orthographic"],
  ["9", "view-opposite", "the opposite side, orthographic"],
  ["5", "parallel", "orthographic or in perspective"],
];

const TILT = 1e-4; // by which a view from above leans to the front, which is then below

export class Strip {
  private readonly form = new Form(markup);
  private readonly ruler: Ruler;
  private playing: AbortController | null = null;
  private films: Film[] = [];

  constructor(private readonly app: App) {
    const { form } = this;
    const { viewer } = app;
    this.ruler = new Ruler(viewer);
    form.on({
      whole: () => viewer.fit(),
      views: () => (form.get("views-menu").hidden = !this.toggle("views")),
      "view-front": () => this.lookFrom(2),
      "view-right": () => this.lookFrom(0),
      "view-top": () => this.lookFrom(1),
      "view-opposite": () => this.look(viewer.axes.towards.negate()),
      parallel: () => this.showParallel(!viewer.parallel),
      edges: () => {
        viewer.edges.show(this.toggle("edges"));
        viewer.invalidate();
      },
      texture: () => viewer.showTexture(this.toggle("texture")),
      cut: () => {
        form.get("cut-menu").hidden = !this.toggle("cut");
        this.cut();
      },
      "cut-along": () => this.cut(),
      "cut-place": () => this.cut(),
      measure: () => (this.toggle("measure") ? this.ruler.start() : this.ruler.stop()),
      film: () => {
        form.get("film-menu").hidden = !this.toggle("film");
        this.stop();
        this.listFilms();
      },
      "film-kind": () => this.stop(),
      "film-play": () => this.play(),
      "film-save": () => this.saveFilm(),
      "film-page": () => app.save("html", "html"),
      finger: () => {
        viewer.fingerTurns = !viewer.fingerTurns;
        this.showFinger();
        app.refreshPanels(); // the hint says what a finger does
      },
    });
    for (const [key, name, text] of KEYS)
      app.shortcut(key, `Picture: ${text ?? name}`, () => form.get(name).click());
    form.get("film-page").hidden = !app.state.capabilities.includes("finish");
    form.get("parallel").ariaPressed = String(viewer.parallel); // the view of a page that is loaded again
    this.showFinger();
    this.refresh();
    viewer.stage.append(form.root);
  }

  /** Only a shape whose file says how it looks can be seen without that. */
  refresh(): void {
    this.form.get("texture").hidden = this.app.state.n_images < 0;
  }

  /** Films belong to the panel that is shown. */
  panelShown(): void {
    this.stop();
    this.listFilms();
  }

  private toggle(name: string): boolean {
    const on = this.form.get(name).ariaPressed !== "true";
    this.form.get(name).ariaPressed = String(on);
    return on;
  }

  /** Return the axes of the coordinates that point to the right, up, and to the front. */
  private get axes(): [Vector3, Vector3, Vector3] {
    const { up, towards } = this.app.state;
    const above = nearestAxis(new Vector3(...up));
    const front = nearestAxis(new Vector3(...towards).projectOnPlane(above));
    return [above.clone().cross(front), above, front];
  }

  private lookFrom(axis: 0 | 1 | 2): void {
    this.look(this.axes[axis]);
  }

  /** Show the shape from a side, as in a drawing. */
  private look(side: Vector3): void {
    const [, , front] = this.axes;
    this.showParallel(true);
    this.app.viewer.fit(nearestAxis(side).addScaledVector(front, TILT).toArray());
  }

  private showParallel(parallel: boolean): void {
    this.app.viewer.parallel = parallel;
    this.form.get("parallel").ariaPressed = String(parallel);
  }

  private cut(): void {
    const { form, app } = this;
    const [right, above, front] = this.axes;
    const direction = [front, right, above][form.get<HTMLSelectElement>("cut-along").selectedIndex]!;
    const on = form.get("cut").ariaPressed === "true";
    app.viewer.cut(on ? direction : null, form.number("cut-place"));
  }

  private listFilms(): void {
    this.films = [...this.app.films(), turntable(this.app.viewer)];
    const options = this.films.map(({ title }) => h("option", {}, title));
    this.form.get("film-kind").replaceChildren(...options);
  }

  private get film(): Film {
    return this.films[this.form.get<HTMLSelectElement>("film-kind").selectedIndex]!;
  }

  private play(): void {
    if (this.playing) return this.stop();
    this.playing = new AbortController();
    this.form.get("film-play").ariaPressed = "true";
    this.form.text("film-play", "Stop");
    playFilm(this.film, this.playing.signal).catch((error) => this.app.fail(error));
  }

  private stop(): void {
    this.playing?.abort();
    this.playing = null;
    this.form.get("film-play").ariaPressed = "false";
    this.form.text("film-play", "Play");
  }

  private async saveFilm(): Promise<void> {
    const { app } = this;
    this.stop();
    const ground = getComputedStyle(app.main).getPropertyValue("--stage");
    const told = (share: number) => app.say(`Drawing the film: ${Math.round(100 * share)} %`);
    const gif = await app.run("Drawing the film", saveGif(app.viewer, this.film, ground, told));
    if (!gif) return;
    app.say("");
    download(gif, app.fileName("gif"), "image/gif");
  }

  private showFinger(): void {
    const { fingerTurns } = this.app.viewer;
    this.form.get("finger").ariaPressed = String(!fingerTurns);
    this.form.text("finger", fingerTurns ? "Finger: turns" : "Finger: bends or paints");
  }
}
