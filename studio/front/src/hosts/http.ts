/** The studio's own server: one POST for each call, sent again while no server answers. */

import { backendOver, type Backend } from "../core/backend";

const PAUSE = 1000; // ms between two trials
// Statuses after which a call is sent again: a body that came too slowly, too many calls, a shape
// that is being prepared.
const AGAIN = [408, 429, 503];

export function httpBackend(tab: string, pause = PAUSE): Backend {
  let waiting = 0; // calls that found no server
  const backend = backendOver(async (call, message) => {
    const headers = { "Content-Type": "application/octet-stream", "X-Eigenshape-Tab": tab };
    for (let troubled = false; ; ) {
      const request = { method: "POST", headers, body: message };
      const answer = await fetch(`api/${call}`, request).catch(() => null);
      const why = reasonToWait(answer);
      if (why === null && troubled && --waiting === 0) backend.trouble(null);
      if (why === null && answer && !AGAIN.includes(answer.status)) {
        // Errors of the library are messages too; other answers, such as that of a guard, are text.
        if (answer.headers.get("Content-Type") === headers["Content-Type"])
          return answer.arrayBuffer();
        throw new Error(`${answer.status}: ${(await answer.text()).slice(0, 200)}`);
      }
      if (why !== null) {
        if (!troubled) waiting += 1;
        backend.trouble(why);
      }
      troubled = why !== null;
      await new Promise((done) => setTimeout(done, pause));
    }
  });
  return backend;
}

/** Return why a call has to wait for a server, or null if it was answered. */
function reasonToWait(answer: Response | null): string | null {
  if (!answer)
    return "The studio does not answer. Your work is kept, and this page tries again …";
  if (answer.status !== 403) return null;
  return (
    "The studio was started anew. Open the address that it has printed in this browser; " +
    "then this page goes on where it was."
  );
}
