/** A note above the panels: what could not be opened, and what can be asked for of a large shape. */

import type { App } from "./contract";
import type { State } from "./core/backend";
import { Form } from "./core/dom";
import markup from "./large.html?raw";

export class LargeNote {
  private readonly form = new Form(markup);

  constructor(app: App) {
    const ask = (kind: string, text: string) => () => app.change({ kind }, text);
    this.form.on({
      lighten: ask("lighten", "Making a lighter copy"),
      examine: ask("examine", "Starting to examine"),
      prepare: ask("prepare", "Starting to compute"),
    });
    app.main.querySelector("[data-test=panels]")!.before(this.form.root);
  }

  refresh({ large, notes, losses, place, health, deformation, capabilities }: State): void {
    const { form } = this;
    // Notes: until something is done
    const lines = [...losses, ...(place ? [] : notes), large].filter(Boolean);
    form.root.hidden = !lines.length || !capabilities.includes("finish");
    form.text("large-text", lines.join(" "));
    form.get("asking").hidden = !large;
    form.get("examine").hidden = health.status !== "none";
    form.get("prepare").hidden = deformation.status !== "none";
  }
}
