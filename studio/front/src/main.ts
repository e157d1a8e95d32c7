/** Start the studio in the page that loads this bundle; a notebook calls `render` instead. */

import { Settings, Studio, type Panel } from "./app";
import type { Backend } from "./core/backend";
import { httpBackend } from "./hosts/http";
import { inlineBackend } from "./hosts/inline";
import { widgetBackend, type WidgetModel } from "./hosts/widget";
import { DeformPanel } from "./panels/deform";
import { HeatPanel } from "./panels/heat";
import { PartsPanel } from "./panels/parts";
import { SearchPanel } from "./panels/search";
import { ShapePanel } from "./panels/shape";
import { SpectrumPanel } from "./panels/spectrum";

function makePanels(): Panel[] {
  return [new DeformPanel(), new ShapePanel(), new SpectrumPanel(), new HeatPanel(), new PartsPanel(), new SearchPanel()];
}

/** Return the number of this tab, which the server knows its session by; it survives a reload. */
function tabNumber(settings: Settings): string {
  const number = settings.get("tab", "") || crypto.randomUUID();
  settings.set("tab", number);
  return number;
}

/** Let the studio fill the window. */
function fillWindow(host: HTMLElement): HTMLElement {
  document.body.style.margin = "0";
  host.style.height = "100vh";
  return host;
}

function start(backend: Backend, host: HTMLElement, settings: Settings, keys: EventTarget): Studio {
  const studio = new Studio(backend, host, makePanels(), settings, keys);
  studio.start().catch((error) => studio.fail(error));
  return studio;
}

const page = document.getElementById("eigenshape-studio");
const data = document.getElementById("eigenshape-data");
// The page around the studio; a notebook has its own.
if (page || data) {
  const sheet = new CSSStyleSheet();
  sheet.replaceSync("html, body, body > div { height: 100%; margin: 0; }");
  document.adoptedStyleSheets = [sheet];
}
if (page) {
  const settings = new Settings(sessionStorage);
  // For tests.
  (window as any).eigenshape = start(httpBackend(tabNumber(settings)), fillWindow(page), settings, window);
} else if (data) {
  const host = fillWindow(document.body.appendChild(document.createElement("div")));
  // All files share one storage, so each report has a key of its own.
  const settings = new Settings(sessionStorage, `eigenshape ${location.pathname}`);
  inlineBackend(data).then((backend) => ((window as any).eigenshape = start(backend, host, settings, window)));
}

/** Show the studio in the output of a notebook's cell (anywidget). */
function render({ model, el }: { model: WidgetModel; el: HTMLElement }): () => void {
  const host = el.appendChild(document.createElement("div"));
  host.style.height = `${model.get("height") ?? 640}px`;
  const { viewer } = start(widgetBackend(model), host, new Settings(null), host);
  return () => viewer.dispose();
}

export default { render };
