/** Small helpers to build the page. */

type Child = Node | string | null | undefined | false;
type Attributes = Record<string, unknown>;

/** Return an element: `on...` entries are listeners, booleans are flags, the rest are attributes. */
export function h<K extends keyof HTMLElementTagNameMap>(
  tag: K,
  attributes: Attributes = {},
  ...children: Child[]
): HTMLElementTagNameMap[K] {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (typeof value === "function") element.addEventListener(name.slice(2), value as EventListener);
    else if (typeof value === "boolean") element.toggleAttribute(name, value);
    else if (value !== null && value !== undefined) element.setAttribute(name, String(value));
  }
  element.append(...children.filter((child): child is Node | string => !!child));
  return element;
}

/** Return a button; `name` is its data-test, and `title` its tooltip and description. */
export function button(label: string, name: string, title: string, action: () => void) {
  return h("button", { type: "button", "data-test": name, title, onclick: action }, label);
}

/** Offer bytes as a file. */
export function download(data: BlobPart, name: string, type = "application/octet-stream") {
  const link = h("a", { download: name, href: URL.createObjectURL(new Blob([data], { type })) });
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10_000);
}

export interface ChosenFile {
  name: string;
  bytes: Uint8Array<ArrayBuffer>;
}

/** Let the person choose files, and return their names and bytes. */
export function chooseFiles(accept: string, multiple = true): Promise<ChosenFile[]> {
  const read = async (file: File) => ({ name: file.name, bytes: new Uint8Array(await file.arrayBuffer()) });
  return new Promise((resolve) => {
    const input = h("input", { type: "file", accept, multiple });
    input.addEventListener("change", () => resolve(Promise.all([...(input.files ?? [])].map(read))));
    input.click();
  });
}

export const chooseFile = async (accept: string) => (await chooseFiles(accept, false))[0]!;
