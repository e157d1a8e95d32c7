/** Start the studio in the page that loads this bundle; a notebook calls `render` instead. */

import { Settings, Studio, type Panel } from "./app";
import { httpBackend } from "./hosts/http";

const panels: Panel[] = [];

/** Return the number of this tab, which the server knows its session by; it survives a reload. */
function tabNumber(settings: Settings): string {
  const number = settings.get("tab", "") || crypto.randomUUID();
  settings.set("tab", number);
  return number;
}

const page = document.getElementById("eigenshape-studio");
if (page) {
  const settings = new Settings(sessionStorage);
  const studio = new Studio(httpBackend(tabNumber(settings)), page, panels, settings, window);
  (window as any).eigenshape = studio; // for tests
  studio.start().catch((error) => studio.fail(error));
}
