/** The studio's own server: one POST for each call. */

import { backendOver, type Backend } from "../core/backend";

export function httpBackend(tab: string): Backend {
  return backendOver(async (call, message) => {
    const headers = { "Content-Type": "application/octet-stream", "X-Eigenshape-Tab": tab };
    const answer = await fetch(`api/${call}`, { method: "POST", headers, body: message }).catch(
      () => {
        throw new Error("The studio's server does not answer. Is it still running?");
      },
    );
    // Errors of the library are messages too; other answers, such as that of a guard, are text.
    if (answer.headers.get("Content-Type") !== headers["Content-Type"])
      throw new Error(`${answer.status}: ${(await answer.text()).slice(0, 200)}`);
    return answer.arrayBuffer();
  });
}
