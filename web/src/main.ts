// The page: four parts, one shown at a time. The address selects the part and its settings.
import { families } from "./families";
import { calibrate } from "./calibrate";
import { el } from "./dom";
import { drawing } from "./library";
import { make } from "./make";
import { see } from "./see";
import { words } from "./words";

const parts = { make, see, calibrate, families };
type Part = keyof typeof parts;

const main = document.getElementById("main") as HTMLElement;
const tabs = document.getElementById("tabs") as HTMLElement;
const shown = new Map<Part, HTMLElement>();

function asked(): Part {
  const name = location.hash.slice(1).split("?")[0] ?? "";
  return name in parts ? (name as Part) : "make";
}

function show(): void {
  const part = asked();
  const page = shown.get(part) ?? parts[part]();
  shown.set(part, page);
  main.replaceChildren(page);
  document.title = `${words.tabs[part]} · ${words.title}`;
  for (const link of tabs.querySelectorAll("a")) {
    const isIt = link.dataset.part === part;
    if (isIt) link.setAttribute("aria-current", "page");
    else link.removeAttribute("aria-current");
  }
}

// The address selects the part shown, so skipping to the content must not change it.
const skip = document.querySelector(".skip") as HTMLElement;
skip.textContent = words.skip;
skip.addEventListener("click", (event) => {
  event.preventDefault();
  main.focus();
});
tabs.setAttribute("aria-label", words.parts);
for (const part of Object.keys(parts) as Part[]) {
  const link = el("a", { href: `#${part}`, "data-part": part }, words.tabs[part]);
  tabs.append(link);
}
const footer = document.getElementById("footer") as HTMLElement;
const version = el("span");
footer.append(el("p", {}, words.privacy), el("p", {}, version));
// A file dropped outside the drop area must not replace the page.
for (const name of ["dragover", "drop"]) window.addEventListener(name, (event) => event.preventDefault());
window.addEventListener("hashchange", show);
show();
drawing.call("version").then((of) => version.replaceChildren(words.version(of)), () => undefined);

// Once loaded, the page works offline.
if ("serviceWorker" in navigator && import.meta.env.PROD) void navigator.serviceWorker.register("./sw.js").catch(() => undefined);
