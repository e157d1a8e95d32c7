/** What survives a reload of the page, in the storage of the tab. */
export class Settings {
  private readonly values: Record<string, unknown>;

  constructor(
    private readonly storage: Storage | null,
    private readonly key = "eigenshape",
  ) {
    this.values = JSON.parse(storage?.getItem(key) ?? "{}");
  }

  get<T>(name: string, otherwise: T): T {
    return (this.values[name] as T | undefined) ?? otherwise;
  }

  set(name: string, value: unknown): void {
    this.values[name] = value;
    this.storage?.setItem(this.key, JSON.stringify(this.values));
  }
}
