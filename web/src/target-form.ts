// The form of a target: its kind, and the settings of that kind.
import { el, field, select } from "./dom";
import { icon } from "./icons";
import { KINDS, PLACES, type Settings, applies, hasSquareTags, isBoard, isSolid, ofKind, usualFamily } from "./settings";
import { words } from "./words";
import type { FamilyFacts } from "./worker";

/** Ids are 32-bit numbers. */
const MAX_IDS = 2 ** 32 - 1;
// list: papers (written by tests/it/files/lists.rs)
const papers = ["A0", "A1", "A2", "A3", "A4", "A5", "letter", "legal", "tabloid"];
// end of list
/** Whether a text may be a paper: a name, or two lengths such as 297x420mm. */
export const isPaper = (text: string): boolean => papers.some((paper) => paper.toLowerCase() === text.toLowerCase()) || /^[\d.]+ ?(mm|cm|m|in)? ?[x×] ?[\d.]+ ?(mm|cm|m|in)?$/i.test(text);
/** Ranges of rows and columns. */
const SIDES: Record<string, [number, number]> = { charuco: [3, 200], aprilgrid: [2, 100], circles: [2, 200] };

export type Known = { families: FamilyFacts[]; dictionaries: string[] };

type Given = {
  /** Takes a change; `isForm` if other fields depend on it. */
  changed: (change: Partial<Settings>, isForm?: boolean) => void;
  chooseMesh: () => void;
  chooseLogo: () => void;
};

/** The kinds of targets, and the fields of one of them; `fill` shows other settings. */
export function targetForm({ changed: report, chooseMesh, chooseLogo }: Given): { kinds: HTMLElement; form: HTMLFormElement; fill: (settings: Settings, known: Known) => void; showFamily: (name: string) => void } {
  const text = words.make;
  let settings: Settings;
  let familyChoice: HTMLSelectElement | null = null;
  const changed: Given["changed"] = (change, isForm) => {
    settings = { ...settings, ...change };
    report(change, isForm);
  };
  const form = el("form", { class: "form", submit: (event) => event.preventDefault() });
  const radios = KINDS.map((kind) => el("input", { type: "radio", name: "kind", value: kind, change: () => choose(kind) }));
  const kinds = el(
    "fieldset",
    { class: "kinds" },
    el("legend", {}, text.kind),
    ...radios.map((radio) => el("label", {}, radio, icon(radio.value), el("span", {}, text.kinds[radio.value]))),
  );

  function choose(kind: string): void {
    if (kind !== "mesh" || settings.mesh !== null) return changed(ofKind(kind, settings), true);
    for (const radio of radios) radio.checked = radio.value === settings.kind;
    chooseMesh();
  }

  function number(label: string, key: keyof Settings, least: number, most: number, usual?: string, hint?: string): HTMLElement {
    const control = el("input", {
      type: "number",
      name: key,
      min: least,
      max: most,
      step: /_mm$|border|gap/.test(key) ? "any" : 1,
      value: (settings[key] as number | null) ?? "",
      placeholder: usual,
      required: usual === undefined,
      input: () => changed({ [key]: control.value === "" ? null : Number(control.value) } as Partial<Settings>),
    });
    return field(label, control, hint);
  }

  function box(label: string, key: keyof Settings): HTMLElement {
    const control = el("input", { type: "checkbox", name: key, change: () => changed({ [key]: control.checked } as Partial<Settings>) });
    control.checked = settings[key] as boolean;
    const whole = field(label, control);
    whole.classList.add("box");
    return whole;
  }

  function line(label: string, key: keyof Settings, usual?: string): HTMLElement {
    const control = el("input", { type: "text", name: key, value: (settings[key] as string | null) ?? "", placeholder: usual, input: () => changed({ [key]: control.value || null } as Partial<Settings>) });
    return field(label, control);
  }

  const firstId = () => number(text.firstId, "first_id", 0, MAX_IDS);

  function measures(): HTMLElement[] {
    const { kind } = settings;
    if (kind === "cuboid") return [line(text.size, "size", "200x150x100mm"), number(text.tiles, "tiles", 6, 200, text.usual)];
    if (isSolid(settings)) return [number(text.solidEdge, "edge_mm", 1, 100_000, kind === "mesh" ? text.usualEdge : settings.paper ? text.fitting : "150"), number(text.tiles, "tiles", 6, 200, text.usual)];
    const { rows, cols, edge } = text.labels[kind] ?? { rows: "", cols: "", edge: "" };
    const [least, most] = SIDES[kind] ?? [2, 500];
    const usualEdge: Record<string, string> = { charuco: "30", aprilgrid: "25", circles: "20" };
    const own: Record<string, HTMLElement[]> = {
      charuco: [number(text.marker, "marker_mm", 0.1, 1000, text.usualMarker), firstId()],
      aprilgrid: [number(text.gap, "gap", 0.1, 0.9, "0.3"), firstId()],
      circles: [number(text.diameter, "diameter_mm", 0.1, 1000, text.usualDiameter), box(text.asymmetric, "asymmetric")],
    };
    return [number(rows, "rows", least, most), number(cols, "cols", least, most), number(edge, "edge_mm", 1, 1000, usualEdge[kind] ?? text.fitting), ...(own[kind] ?? [])];
  }

  function families({ families, dictionaries }: Known): HTMLElement[] {
    if (!applies("family", settings)) return [];
    const { kind, family, family_file } = settings;
    const ofTiles = families.filter((known) => (known.kind === "checker") === hasSquareTags(settings));
    const names = kind === "charuco" ? dictionaries : ofTiles.map(({ name }) => name);
    const options: [string, string][] = names.map((name) => [name, name]);
    if (kind !== "charuco" && !hasSquareTags(settings)) options.push([PLACES, text.places]);
    if (isBoard(settings) || isSolid(settings)) options.push(["", text.noTags]);
    // Keep a family from a file, link or template visible, even if it is unknown.
    if (family && !options.some(([name]) => name === family)) options.push([family, family_file ? text.ownFamily(family) : family]);
    familyChoice = select(options, family ?? usualFamily(kind), (name) => {
      const family_file = name === settings.family ? settings.family_file : null;
      changed(name === PLACES ? { family: name, family_file, tag_spacing: null, first_id: 0 } : { family: name, family_file }, true);
    });
    familyChoice.name = "family";
    return [field(kind === "charuco" ? text.dictionary : text.family, familyChoice)];
  }

  function paper(): HTMLElement[] {
    const { paper } = settings;
    const isOther = paper !== null && !papers.includes(paper);
    const other = isOther ? paper : text.otherPaper;
    const options: [string, string][] = [["", text.smallest], ...papers.map((paper): [string, string] => [paper, paper]), [other, other]];
    const choice = select(options, paper ?? "", (paper) => changed({ paper: paper === text.otherPaper ? "400x300mm" : paper || null }, true));
    choice.name = "paper";
    const [, width, height] = /^([\d.]+) ?[x×] ?([\d.]+) ?mm$/.exec(paper ?? "") ?? [];
    const pages = isSolid(settings) && !settings.per_face ? [number(text.pages, "pages", 1, 500, text.usual)] : [];
    if (!isOther || width === undefined) return [field(text.paper, choice), ...pages];
    const side = (label: string, value: string | undefined) => {
      const control = el("input", { type: "number", min: 50, max: 5080, step: "any", required: true, value: value ?? "", input: resized });
      return { control, field: field(label, control) };
    };
    const sides = [side(text.paperWidth, width), side(text.paperHeight, height)] as const;
    function resized(): void {
      const paper = `${sides.map(({ control }) => control.value).join("x")}mm`;
      const option = choice.selectedOptions[0];
      if (option) option.value = option.text = paper;
      changed({ paper });
    }
    return [field(text.paper, choice), ...sides.map(({ field }) => field), ...pages];
  }

  function tags(): HTMLElement[] {
    const isDense = settings.family === PLACES;
    const hasTags = applies("first_id", settings) && (settings.family ?? usualFamily(settings.kind)) !== "";
    const own = (key: keyof Settings, make: () => HTMLElement) => (hasTags && applies(key, settings) ? [make()] : []);
    return [
      ...own("tags_in", () => field(text.tagsIn, select(Object.entries(text.tagsInColours), settings.tags_in, (tags_in) => changed({ tags_in })))),
      ...(isDense ? [] : own("tag_spacing", () => number(text.spacing, "tag_spacing", 1, 500, text.usual))),
      ...own("tag_border", () => number(text.border, "tag_border", 0.6, 10, text.usual)),
      ...(isDense || !(isBoard(settings) || isSolid(settings)) ? [] : own("first_id", firstId)),
      number(text.boardId, "board_id", 0, MAX_IDS),
      ...(isBoard(settings) ? [number(text.boards, "boards", 1, 500)] : []),
      ...own("tag_ids", () => box(text.tagIds, "tag_ids")),
      ...(isDense ? [] : own("hole_mm", () => number(text.hole, "hole_mm", 0.5, 1000, text.none, text.holeHint))),
    ];
  }

  function extras(): HTMLElement[] {
    const own = (key: keyof Settings, make: () => HTMLElement) => (applies(key, settings) ? [make()] : []);
    const logo = el("button", { type: "button", click: () => (settings.logo === null ? chooseLogo() : changed({ logo: null, logo_height_mm: null }, true)) }, settings.logo === null ? text.chooseLogo : text.removeLogo);
    return [
      el("div", { class: "field" }, logo),
      ...(settings.logo === null ? [] : [number(text.logoHeight, "logo_height_mm", 1, 1000, text.usual)]),
      line(text.note, "note", text.none),
      ...own("two_sided_mm", () => number(text.twoSided, "two_sided_mm", 0.1, 1000, text.oneSide)),
      number(text.kerf, "kerf_mm", 0, 10, "0"),
      ...own("legacy", () => box(text.legacy, "legacy")),
      ...own("inverted", () => box(text.inverted, "inverted")),
      ...own("mirrored", () => box(text.mirrored, "mirrored")),
      ...own("skeleton", () => box(text.skeleton, "skeleton")),
      box(text.guide, "guide_page"),
    ];
  }

  function sheet(): HTMLElement[] {
    return [
      field(text.orientation, select(Object.entries(text.orientations), settings.orientation, (orientation) => changed({ orientation }))),
      number(text.margin, "margin_mm", 0, 100, text.usual),
      ...(isSolid(settings) ? [number(text.faceMargin, "face_margin_mm", 0, 1000, text.usual), box(text.perFace, "per_face"), box(text.allowSeams, "allow_seams")] : []),
      ...(isBoard(settings) ? [box(text.poster, "poster"), box(text.packed, "packed")] : []),
    ];
  }

  function fill(shown: Settings, known: Known): void {
    settings = shown;
    for (const radio of radios) radio.checked = radio.value === settings.kind;
    const isOpen = form.querySelector("details")?.open ?? false;
    const name = el("input", { type: "text", name: "name", required: true, pattern: "[A-Za-z0-9_][A-Za-z0-9_.\\-]{0,63}", title: text.names, value: settings.name, input: () => changed({ name: name.value }) });
    const group = (title: string, fields: HTMLElement[]) => el("fieldset", {}, el("legend", {}, title), ...fields);
    familyChoice = null;
    form.replaceChildren(
      ...measures(),
      ...families(known),
      ...paper(),
      field(text.name, name),
      el("details", { open: isOpen }, el("summary", {}, text.more), group(text.groups.sheet, sheet()), group(text.groups.tags, tags()), group(text.groups.extras, extras())),
    );
  }

  return { kinds, form, fill, showFamily: (name) => familyChoice && (familyChoice.value = name) };
}
