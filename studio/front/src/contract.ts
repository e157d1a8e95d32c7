/** What the window and its contents know of each other, so that none of them imports the window. */

import type { Backend, Change, State } from "./core/backend";
import type { Beside } from "./core/beside";
import type { Form, NamedFile } from "./core/dom";
import type { Film } from "./core/film";
import type { Settings } from "./core/settings";
import type { Viewer } from "./core/viewer";
import type { Arrays, TypedArray } from "./core/wire";

export interface Panel {
  id: string;
  title: string;
  needs: string[]; // capabilities without which the panel is hidden
  build(app: App): HTMLElement;
  refresh(state: State): void;
  shown?(): void;
  hidden?(): void;
  /** What can be played of what the panel shows. */
  films?(): Film[];
}

/** The window, as its panels, dialogs and strip see it. */
export interface App {
  readonly backend: Backend;
  readonly settings: Settings;
  readonly state: State;
  readonly viewer: Viewer;
  readonly main: HTMLElement;
  readonly folders: { show(): Promise<boolean> }; // whether a folder was opened
  second: Beside | null; // picture of the second shape
  readonly secondShown: ((second: Beside) => void)[]; // called when its shape is there

  say(text: string): void;
  fail(error: unknown): void;
  /** Show `text` as the status while `work` runs; return null if it fails, and say why. */
  run<T>(text: string, work: Promise<T>): Promise<T | null>;
  /** Return an array that the library computes, or null if it cannot; the status says why. */
  load<T extends TypedArray>(name: string, text: string): Promise<T | null>;
  /** Make a change on the server, show its result and its warnings; return whether it was made. */
  change(change: Change, text: string, files?: Arrays): Promise<boolean>;
  can(kind: "undo" | "redo"): boolean;
  /** Undo or redo what the hand did last, when what it does now is done. */
  step(kind: "undo" | "redo"): Promise<void>;

  /** Let the person choose files; none if one cannot be read, and the status says why. */
  choose(suffixes?: string, multiple?: boolean): Promise<NamedFile[]>;
  /** Let a file be dropped on an element. */
  acceptDrops(element: HTMLElement, onFile: (file: NamedFile) => void): void;
  /** Let a file become the shape; return whether it did. */
  openFile(file: NamedFile): Promise<boolean>;
  /** Save a file that the library writes: a mesh format, or the edits. */
  save(kind: string, ending: string): Promise<void>;
  /** Add buttons that save the shape, one for each format, to the row of a form with this name. */
  addExports(form: Form, row: string): void;
  fileName(ending: string): string;

  /** Bind a key such as "g", "Shift+D" or "Ctrl+Z"; the overview lists it with its text. */
  shortcut(key: string, text: string, action: () => void): void;
  /** Show a panel. */
  open(id: string): void;
  refreshPanels(): void;
  /** Return what can be played of what is shown. */
  films(): Film[];
  /** Show how the studio works, unless this person has seen it. */
  firstTour(): void;
}
