// The page of the service: a scan is dropped, and the most similar shapes are shown.

const MOST_DOTS = 24; // of each match; the surest pairs come first
const find = (id) => document.getElementById(id);
const drop = find("drop");
const file = find("file");
let running = null; // what ends the query that is under way
let scan = null; // the last file, for another query with other options

/** Make an element with a class, a text and children; a text is never read as HTML. */
function make(tag, name = "", text = "", ...children) {
  const element = document.createElement(tag);
  element.className = name;
  element.textContent = text;
  element.append(...children);
  return element;
}

function say(text, kind = "") {
  find("status").textContent = text;
  find("status").className = `status ${kind}`;
}

/** Fetch JSON; throw an error with the sentence of the server. */
async function call(address, options = {}) {
  const answer = await fetch(address, options).catch((error) => {
    if (error.name === "AbortError") throw error;
    throw new Error("The service does not answer. Was it ended?");
  });
  const text = await answer.text();
  let found = null;
  try {
    found = JSON.parse(text);
  } catch {
    // What refuses a connection answers in plain text.
  }
  if (!answer.ok) throw new Error(found?.error ?? (text || `The answer has status ${answer.status}.`));
  return found;
}

/** Draw dots over a picture; places are shares of its width and height. */
function dots(places) {
  const space = "http://www.w3.org/2000/svg";
  const drawing = document.createElementNS(space, "svg");
  drawing.setAttribute("viewBox", "0 0 100 100");
  drawing.setAttribute("aria-hidden", "true");
  for (const { place, color } of places.filter(({ place }) => place)) {
    const dot = document.createElementNS(space, "circle");
    dot.setAttribute("cx", 100 * place[0]);
    dot.setAttribute("cy", 100 * place[1]);
    dot.setAttribute("r", 2.2);
    dot.setAttribute("fill", color);
    drawing.append(dot);
  }
  return drawing;
}

function picture(address, text) {
  const image = make("img");
  image.alt = text;
  image.src = address;
  return make("span", "picture", "", image);
}

async function search() {
  running?.abort();
  running = new AbortController();
  const { signal } = running;
  const wanted = new URLSearchParams({ name: scan.name, n: find("count").value || 8, picture: 1 });
  if (find("label").value.trim()) wanted.set("filter", `label=${find("label").value.trim()}`);
  find("matches").replaceChildren();
  find("scan-picture").hidden = true;
  find("hint").hidden = false;
  find("scan-facts").textContent = scan.name;
  say("Describing the scan …", "busy");
  try {
    const answer = await call(`v1/query?${wanted}`, {
      method: "POST",
      headers: { "content-type": "application/octet-stream" },
      body: scan,
      signal,
    });
    show(answer, signal);
  } catch (error) {
    if (error.name !== "AbortError") say(error.message, "bad");
  }
}

function show(answer, signal) {
  const { scan: facts, seconds, matches } = answer;
  const counts = `${facts.n_vertices.toLocaleString("en")} vertices, ${facts.n_faces.toLocaleString("en")} faces`;
  const repairs = facts.repairs.map((line) => `Repaired: ${line}`);
  find("scan-facts").textContent = [facts.name, counts, ...repairs].join("\n");
  find("hint").hidden = true;
  find("scan-picture").hidden = false;
  find("scan-picture").replaceChildren(...picture(answer.picture.image, "The scan").children);
  const times = `described in ${seconds.describe.toFixed(2)} s, searched in ${(1000 * seconds.search).toFixed(0)} ms`;
  const count = matches.length === 1 ? "1 similar shape" : `${matches.length} similar shapes`;
  const doubt = answer.nothing_alike ? " Probably nothing in the index is like this scan." : "";
  say(matches.length ? `${count}; ${times}.${doubt}` : "No shape of the index can be compared.");
  const cards = matches.map((match, rank) => card(match, rank, answer.picture, signal));
  find("matches").replaceChildren(...cards);
  if (cards.length) cards[0].firstChild.click();
}

function card(match, rank, drawn, signal) {
  const stage = make("span", "stage");
  const line = (left, right) => make("span", "line", "", make("span", "", left), make("b", "", right));
  const lines = [
    line(match.label ?? "no label", ""),
    line("score", match.score.toFixed(3) + (match.mirrored ? ", mirror image" : "")),
    line("corresponding points", String(match.n_pairs)),
  ];
  if (match.chance !== null) lines.push(line("chance", `${Number((100 * match.chance).toPrecision(2))} %`));
  const button = make("button", "", "", stage, make("span", "name", match.name), ...lines);
  button.type = "button";
  button.title = match.source ?? match.name;
  button.setAttribute("aria-pressed", "false");
  const pairs = match.pairs.slice(0, MOST_DOTS);
  button.addEventListener("click", () => {
    for (const other of document.querySelectorAll("li button")) {
      other.setAttribute("aria-pressed", String(other === button));
    }
    const places = pairs.map(([ours]) => ({ place: drawn.points[ours], color: drawn.colors[ours] }));
    const shown = find("scan-picture");
    shown.querySelector("svg")?.remove();
    shown.append(dots(places));
  });
  void illustrate(stage, match, pairs, drawn, signal);
  const item = make("li", "", "", button);
  item.dataset.test = `match-${rank}`;
  return item;
}

/** Show the picture of a match with its dots; a match whose file is gone has none. */
async function illustrate(stage, match, pairs, drawn, signal) {
  const theirs = pairs.map(([, vertex]) => vertex).join(",");
  const wanted = new URLSearchParams({ name: match.name, id: match.id, vertices: theirs });
  try {
    const { points, thumbnail } = await call(`v1/points?${wanted}`, { signal });
    if (!thumbnail) {
      stage.textContent = "no picture";
      return;
    }
    const shown = picture(thumbnail, `Picture of ${match.name}`);
    shown.append(dots(points.map((place, k) => ({ place, color: drawn.colors[pairs[k][0]] }))));
    stage.replaceChildren(shown);
  } catch (error) {
    if (error.name !== "AbortError") stage.textContent = error.message;
  }
}

function take(files) {
  if (!files.length) return;
  scan = files[0];
  void search();
}

file.addEventListener("change", () => {
  take(file.files);
});
find("options").addEventListener("submit", (event) => event.preventDefault());
find("options").addEventListener("change", () => scan && void search());
// A file that is dropped beside the field is searched for, too: otherwise the browser would open it.
addEventListener("dragover", (event) => {
  event.preventDefault();
  drop.classList.add("over");
});
addEventListener("dragleave", (event) => {
  if (!event.relatedTarget) drop.classList.remove("over");
});
addEventListener("drop", (event) => {
  event.preventDefault();
  drop.classList.remove("over");
  take(event.dataTransfer.files);
});
try {
  const { n_shapes } = await call("v1/shapes?limit=1");
  find("index-facts").textContent = `an index of ${n_shapes.toLocaleString("en")} shapes`;
} catch (error) {
  say(error.message, "bad");
}
