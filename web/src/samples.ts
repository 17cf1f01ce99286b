// Bundled sample images for detection.
import photograph from "../../tests/photographs/robot-hand-0108.png?url";
import rendered from "../samples/board.png?url";
import { words } from "./words";

export type Sample = { name: string; address: string; label: string; credit: string };

export const samples: Sample[] = [
  { name: "robot-hand.png", address: photograph, label: words.see.samples.photograph, credit: words.see.samples.credit },
  { name: "board.png", address: rendered, label: words.see.samples.rendered, credit: "" },
];
