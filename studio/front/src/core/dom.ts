/** Elements of the page: made one by one, or as a form out of a text of HTML. */

import type { Progress } from "./backend";

type Child = Node | string | null | undefined | false;

/** Say whether the pointer is a finger. */
export const isTouch = () => matchMedia("(pointer: coarse)").matches;

export const nextFrame = () => new Promise(requestAnimationFrame);

/** Return an element: functions are listeners, booleans are flags, the rest are attributes. */
export function h<K extends keyof HTMLElementTagNameMap>(
  tag: K,
  attributes: Record<string, unknown> = {},
  ...children: Child[]
): HTMLElementTagNameMap[K] {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (typeof value === "function") element.addEventListener(name, value as EventListener);
    else if (typeof value === "boolean") element.toggleAttribute(name, value);
    else element.setAttribute(name, String(value));
  }
  element.append(...children.filter((child): child is Node | string => !!child));
  return element;
}

/** Return the input for one coordinate of a point such as "pivot". */
export function buildCoordinate(name: string, axis: number, change: () => void): HTMLInputElement {
  const title = `${name.replace("-", " ")} ${"xyz"[axis]}`;
  const id = `${name}-${axis}`;
  return h("input", { type: "number", step: "any", "data-test": id, title, "aria-label": title, change });
}

/** Return a coordinate as it is written into its input. */
export const writeCoordinate = (value: number) => String(Number(value.toPrecision(5)));

/** Controls, made out of HTML, by the names in their `data-test`. */
export class Form<Root extends HTMLElement = HTMLElement> {
  readonly root: Root;

  constructor(html: string) {
    const holder = h("div");
    holder.innerHTML = html;
    this.root = holder.firstElementChild as Root;
    // A screen reader reads the title of a control that has no words beside it.
    for (const control of this.root.querySelectorAll<HTMLElement>("input[title], select[title]"))
      control.ariaLabel ??= control.title;
  }

  /** Return an element by its name; most are inputs. */
  get<T extends HTMLElement = HTMLInputElement>(name: string): T {
    return this.root.querySelector<T>(`[data-test="${name}"]`)!;
  }

  /** Let buttons and inputs do something when they are clicked or changed. */
  on(actions: Record<string, () => unknown>): void {
    for (const [name, action] of Object.entries(actions)) {
      const element = this.get(name);
      const change = element.type === "range" ? "input" : "change";
      element.addEventListener(element.tagName === "BUTTON" ? "click" : change, action);
    }
  }

  /** Let the buttons of a choice, whose names begin alike, do something with the rest of theirs. */
  onChoice(name: string, action: (id: string) => void): void {
    for (const [id, element] of this.choice(name))
      element.addEventListener("click", () => {
        this.press(name, id);
        action(id);
      });
  }

  /** Show one button of a choice as pressed. */
  press(name: string, pressed: string): void {
    for (const [id, element] of this.choice(name))
      element.setAttribute("aria-pressed", String(id === pressed));
  }

  /** Return the buttons of a choice by the rest of their names. */
  choice(name: string): [string, HTMLElement][] {
    const begin = `${name}-`;
    const buttons = this.root.querySelectorAll<HTMLElement>(`button[data-test^="${begin}"]`);
    return [...buttons].map((element) => [element.dataset.test!.slice(begin.length), element]);
  }

  text(name: string, text: string): void {
    this.get(name).textContent = text;
  }

  number(name: string): number {
    return this.get(name).valueAsNumber;
  }

  setRange(name: string, min: number, max: number): void {
    Object.assign(this.get(name), { min, max });
  }

  /** Move a slider, and say in words where it stands. */
  slide(name: string, value: number, text: string): void {
    this.get(name).valueAsNumber = value;
    this.get(name).setAttribute("aria-valuetext", text);
    this.text(`${name}-value`, text);
  }

  /** Show the progress of work on the server, while it runs or if it has failed. */
  progress(name: string, { status, progress, message }: Progress): void {
    const element = this.get(name);
    const [bar, text] = element.children as unknown as [HTMLProgressElement, HTMLElement];
    const failed = status === "failed";
    element.hidden = status !== "running" && !failed;
    bar.hidden = failed;
    bar.value = progress;
    text.textContent = failed ? message : `${Math.round(100 * progress)} % ${message}`;
  }
}

/** Return the address of a picture of bytes; it is given back when an element has loaded it. */
export function pictureOf(png: Uint8Array<ArrayBuffer> | undefined): HTMLImageElement {
  const src = URL.createObjectURL(new Blob(png ? [png] : [], { type: "image/png" }));
  return h("img", { src, alt: "", load: () => URL.revokeObjectURL(src) });
}

/** Offer bytes as a file. */
export function download(data: BlobPart, name: string, type = "application/octet-stream"): void {
  const link = h("a", { download: name, href: URL.createObjectURL(new Blob([data], { type })) });
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10_000);
}

export interface NamedFile {
  name: string;
  bytes: Uint8Array<ArrayBuffer>;
}

/** Read files, unless one is larger than the server takes: the tab would die of it. */
export async function readFiles(files: Iterable<File>, most: number): Promise<NamedFile[]> {
  const megabytes = (bytes: number) => `${Math.ceil(bytes / 2 ** 20).toLocaleString("en")} MB`;
  for (const { name, size } of files)
    if (size > most)
      throw new Error(
        `${name} has ${megabytes(size)}, and the page takes ${megabytes(most)}. ` +
          "Open it from the command line, or make it smaller with eigenshape decimate.",
      );
  return Promise.all(
    [...files].map(async (file) => ({
      name: file.name,
      bytes: new Uint8Array(await file.arrayBuffer()),
    })),
  );
}

/** Let the person choose files of at most so many bytes, and return their names and bytes. */
export function chooseFiles(accept: string, most: number, multiple = false): Promise<NamedFile[]> {
  const input = h("input", { type: "file", accept, multiple });
  return new Promise((resolve) => {
    input.addEventListener("change", () => resolve(readFiles(input.files ?? [], most)));
    input.click();
  });
}

/** Return what a JSON file holds, or null if it is none. */
export function parseJson({ bytes }: NamedFile): unknown {
  try {
    return JSON.parse(new TextDecoder().decode(bytes));
  } catch {
    return null;
  }
}

/** Let a file be dropped on an element. */
export function acceptDrops(element: HTMLElement, onFile: (file: File) => void): void {
  for (const type of ["dragover", "dragleave", "drop"] as const)
    element.addEventListener(type, (event) => {
      event.preventDefault(); // otherwise the browser leaves the page for the file
      event.stopPropagation(); // the innermost element takes it
      element.classList.toggle("dropping", type === "dragover");
      if (type === "drop") [...(event.dataTransfer?.files ?? [])].slice(0, 1).forEach(onFile);
    });
}
