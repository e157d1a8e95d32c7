/** A dialog with the folders of the machine on which the studio runs: of shapes, indexes, collections. */

import type { App } from "./contract";
import { Form, h } from "./core/dom";
import markup from "./folders.html?raw";

interface Listing {
  path: string;
  n_files: number; // of shapes in it
  folders: [name: string, kind: "folder" | "index" | "collection"][];
}

export class FolderDialog {
  private readonly form = new Form<HTMLDialogElement>(markup);
  private place: string[] = []; // names of folders, from the one in which the studio was started

  private opening: Promise<boolean> = Promise.resolve(false);

  constructor(private readonly app: App) {
    app.main.append(this.form.root);
    this.form.on({
      "folder-open": () => this.open(this.place),
      "folder-up": () => this.enter(this.place.slice(0, -1)),
      "folder-close": () => this.form.root.close(),
    });
  }

  /** Let the person choose a folder; return whether it was opened. */
  async show(): Promise<boolean> {
    if (!(await this.enter(this.place))) return false;
    this.opening = Promise.resolve(false);
    this.form.root.showModal();
    await new Promise((done) => this.form.root.addEventListener("close", done, { once: true }));
    return this.opening;
  }

  /** List what is in a folder; return whether it could be read. */
  private async enter(place: string[]): Promise<boolean> {
    const { app, form } = this;
    const bytes = await app.load<Uint8Array>(`folder/${place.join("/") || "."}`, "Reading the folder");
    if (!bytes) return false;
    this.place = place;
    const { path, n_files, folders }: Listing = JSON.parse(new TextDecoder().decode(bytes));
    form.text("folder-path", path);
    const rows = folders.map(([name, kind]) => {
      const inside = [...place, name];
      const click = () => (kind === "folder" ? this.enter(inside) : this.open(inside));
      const attributes = { type: "button", "data-test": `folder-${name}`, click };
      const what = kind !== "folder" && h("span", { class: "faint" }, `opens the ${kind}`);
      return h("li", {}, h("button", attributes, name), what);
    });
    form.get("folder-list").replaceChildren(...rows);
    form.get("folder-empty").hidden = rows.length > 0;
    const shapes = n_files === 1 ? "1 shape" : `${n_files.toLocaleString("en")} shapes`;
    form.text("folder-open", `Open ${shapes} of this folder`);
    form.get("folder-open").hidden = !n_files;
    form.get("folder-up").disabled = !place.length;
    return true;
  }

  private open(place: string[]): void {
    const folder = place.join("/") || ".";
    const text = `Opening ${place.at(-1) ?? "the folder"}`;
    this.opening = this.app.change({ kind: "folder", folder }, text);
    this.form.root.close();
  }
}
