/** Start the studio in the page that loads this bundle; a notebook calls `render` instead. */

import { Studio } from "./app";
import type { Backend } from "./core/backend";
import { h } from "./core/dom";
import { Settings } from "./core/settings";
import { httpBackend } from "./hosts/http";
import { inlineBackend } from "./hosts/inline";
import { widgetBackend, type WidgetModel } from "./hosts/widget";
import { CollectionPanel } from "./panels/collection";
import { ComparePanel } from "./panels/compare";
import { DeformPanel } from "./panels/deform/deform";
import { HeatPanel } from "./panels/heat";
import { LandmarksPanel } from "./panels/landmarks";
import { PartsPanel } from "./panels/parts";
import { SearchPanel } from "./panels/search";
import { ShapePanel } from "./panels/shape";
import { SpectrumPanel } from "./panels/spectrum";

// ms until the name of a session counts as another page's. A page that is loaded again lets it go at
// once, but a busy machine may need a while.
const PATIENCE = 3000;

function start(backend: Backend, host: HTMLElement, settings: Settings, keys: EventTarget): Studio {
  const deform = new DeformPanel();
  const panels = [
    deform,
    new ShapePanel(),
    new SpectrumPanel(),
    new HeatPanel(),
    new PartsPanel(),
    new SearchPanel(() => deform.painted),
    new ComparePanel(),
    new LandmarksPanel(),
    new CollectionPanel(),
  ];
  const studio = new Studio(backend, host, panels, settings, keys);
  studio.start().catch((error) => studio.fail(error));
  return studio;
}

/** Let the studio fill the window of a page of ours; a notebook has its own page. */
function fillWindow(backend: Backend, settings: Settings): void {
  const sheet = new CSSStyleSheet();
  sheet.replaceSync("html, body, body > div { height: 100%; margin: 0; }");
  document.adoptedStyleSheets = [sheet];
  // A file that is dropped beside what takes it would replace the page.
  for (const type of ["dragover", "drop"])
    window.addEventListener(type, (event) => event.preventDefault());
  const page = document.getElementById("eigenshape-studio");
  const host = page ?? document.body.appendChild(h("div"));
  (window as any).eigenshape = start(backend, host, settings, window); // for tests
}

const data = document.getElementById("eigenshape-data");
if (data) {
  // All files share one storage, so each report has a key of its own.
  const settings = new Settings(sessionStorage, `eigenshape ${location.pathname}`);
  // A link such as report.html#parts opens a panel.
  if (location.hash) settings.set("panel", location.hash.slice(1));
  inlineBackend(data).then((backend) => fillWindow(backend, settings));
} else if (document.getElementById("eigenshape-studio")) {
  const settings = new Settings(sessionStorage);
  nameTab(settings).then((tab) => fillWindow(httpBackend(tab), settings));
}

/** Return the number by which the server knows the session of this tab; it survives a reload. */
async function nameTab(settings: Settings): Promise<string> {
  const known = settings.get("tab", "");
  // A browser that duplicates a tab copies its storage, but two tabs must not share a session.
  if (known && (await holdName(known))) return known;
  const bytes = crypto.getRandomValues(new Uint8Array(16));
  const tab = Array.from(bytes, (byte) => byte.toString(16).padStart(2, "0")).join("");
  settings.set("tab", tab);
  holdName(tab);
  return tab;
}

/** Hold a name as long as this page is open; false if another page does not let it go. */
function holdName(name: string): Promise<boolean> {
  if (!navigator.locks) return Promise.resolve(true); // on another machine, without TLS
  const signal = AbortSignal.timeout(PATIENCE);
  return new Promise((resolve) => {
    const hold = () => new Promise<void>(() => resolve(true));
    navigator.locks.request(`eigenshape ${name}`, { signal }, hold).catch(() => resolve(false));
  });
}

/** Show the studio in the output of a notebook's cell (anywidget). */
function render({ model, el }: { model: WidgetModel; el: HTMLElement }): () => void {
  const host = el.appendChild(h("div"));
  host.style.height = `${model.get("height") ?? 640}px`;
  const { viewer } = start(widgetBackend(model), host, new Settings(null), host);
  return () => viewer.dispose();
}

export default { render };
