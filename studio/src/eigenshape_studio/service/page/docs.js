// The page that shows what openapi.json says.

function make(tag, text = "", ...children) {
  const element = document.createElement(tag);
  element.textContent = text;
  element.append(...children);
  return element;
}

const row = (...texts) => make("tr", "", ...texts.map((text) => make("td", text)));

function bounds({ type, minimum, maximum, enum: values, default: usual, maxItems }) {
  const parts = [values ? values.join(" or ") : String(type)];
  if (minimum !== undefined && maximum !== undefined) parts.push(`${minimum} to ${maximum}`);
  if (maxItems !== undefined) parts.push(`at most ${maxItems}`);
  if (usual !== undefined) parts.push(`by default ${usual}`);
  return parts.join(", ");
}

function describe(path, method, call) {
  const title = make("h2", "", make("b", method.toUpperCase()), ` ${path}`);
  const article = make("article", "", title, make("p", call.summary));
  const parameters = call.parameters.map((each) =>
    row(each.name, each.required ? `${bounds(each.schema)}, required` : bounds(each.schema), each.description),
  );
  const body = call.requestBody ? [row("body", "application/octet-stream", call.requestBody.description)] : [];
  const answers = Object.entries(call.responses).map(([status, { description, content }]) =>
    row(status, Object.keys(content ?? {}).join(", "), description),
  );
  article.append(make("table", "", ...parameters, ...body, ...answers));
  return article;
}

const answer = await fetch("openapi.json");
const { paths } = await answer.json();
document.getElementById("example").textContent =
  `curl -H "Authorization: Bearer $EIGENSHAPE_TOKEN" -H "Content-Type: application/octet-stream" \\\n` +
  `     --data-binary @scan.ply "${new URL("v1/query?name=scan.ply&n=5", location.href)}"`;
const articles = Object.entries(paths).flatMap(([path, calls]) =>
  Object.entries(calls).map(([method, call]) => describe(path, method, call)),
);
document.getElementById("calls").replaceChildren(...articles);
