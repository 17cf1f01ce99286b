// The bundled family files, unchanged; each is fetched on first use.
const addresses = import.meta.glob<string>("../../crates/core/families/*.json", { query: "?url", import: "default", eager: true });

const fetched = new Map<string, Promise<string>>();

export const familyNames = (): string[] => Object.keys(addresses).map((path) => path.replace(/^.*\/|\.json$/g, ""));

/** The text of a family file; undefined if no family of that name is bundled. */
export function familyFile(name: string): Promise<string | undefined> {
  const address = Object.entries(addresses).find(([path]) => path.endsWith(`/${name}.json`))?.[1];
  if (!address) return Promise.resolve(undefined);
  const known = fetched.get(name);
  if (known) return known;
  const text = fetch(new URL(address, import.meta.url)).then((answer) => {
    if (!answer.ok) throw new Error(`could not load the file of family ${name}`);
    return answer.text();
  });
  fetched.set(name, text);
  text.catch(() => fetched.delete(name));
  return text;
}
