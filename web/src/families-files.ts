// The bundled family files and tables of OpenCV's dictionaries, unchanged; each is fetched on first use.
const addresses = import.meta.glob<string>(["../../crates/core/families/*.json", "../../crates/core/families/aruco/*.txt"], { query: "?url", import: "default", eager: true });

const fetched = new Map<string, Promise<string>>();

export const familyNames = (): string[] => Object.keys(addresses).flatMap((path) => /([^/]*)\.json$/.exec(path)?.[1] ?? []);

/** The text of a family file; undefined if no family of that name is bundled. */
export const familyFile = (name: string): Promise<string | undefined> => text(`/${name}.json`);

/** The table of a dictionary of OpenCV, or the family file of its AprilTags; undefined for another name. */
export function dictionaryTable(name: string): Promise<string | undefined> {
  const [, tags, side] = /^DICT_(?:APRILTAG_(\w+)|(\d)X\2_\d+)$/.exec(name) ?? [];
  return tags ? familyFile(`aprilTag${tags}`) : side ? text(`/${side}x${side}.txt`) : Promise.resolve(undefined);
}

function text(end: string): Promise<string | undefined> {
  const address = Object.entries(addresses).find(([path]) => path.endsWith(end))?.[1];
  if (!address) return Promise.resolve(undefined);
  const known = fetched.get(end);
  if (known) return known;
  const text = fetch(new URL(address, import.meta.url)).then((answer) => {
    if (!answer.ok) throw new Error(`could not load ${end.slice(1)}`);
    return answer.text();
  });
  fetched.set(end, text);
  text.catch(() => fetched.delete(end));
  return text;
}
