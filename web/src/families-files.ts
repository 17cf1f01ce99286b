// The files of the families, which come along as they are; each is fetched when it is first asked for.
const addresses = import.meta.glob<string>("../../crates/core/families/*.json", { query: "?url", import: "default", eager: true });

const fetched = new Map<string, Promise<string>>();

export const familyNames = (): string[] => Object.keys(addresses).map((path) => path.replace(/^.*\/|\.json$/g, ""));

/** The text of a family's file; nothing where none of that name comes along. */
export function familyFile(name: string): Promise<string | undefined> {
  const address = Object.entries(addresses).find(([path]) => path.endsWith(`/${name}.json`))?.[1];
  if (!address) return Promise.resolve(undefined);
  const known = fetched.get(name);
  if (known) return known;
  const text = fetch(new URL(address, import.meta.url)).then((answer) => {
    if (!answer.ok) throw new Error(`the file of the family ${name} is not where it should be`);
    return answer.text();
  });
  fetched.set(name, text);
  text.catch(() => fetched.delete(name));
  return text;
}
