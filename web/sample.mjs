// Renders samples/board.png, a sample image of the page, with the program (target/release/deltille, or DELTILLE_PROGRAM):
// a board with tags on a desk, in uneven light.
import { execFileSync } from "node:child_process";
import { copyFileSync, mkdtempSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { dirname, join } from "node:path";
import { fileURLToPath } from "node:url";

const web = dirname(fileURLToPath(import.meta.url));
const root = dirname(web);
const program = process.env.DELTILLE_PROGRAM ?? join(root, "target", "release", "deltille");
const folder = mkdtempSync(join(tmpdir(), "sample-"));
const deltille = (...given) => execFileSync(program, given, { stdio: "inherit" });
deltille("board", "--rows", "9", "--cols", "12", "--name", "board", "-o", folder);
deltille("render", join(folder, "board.json"), "--camera", join(root, "templates", "camera.yaml"), "--eye", "350,-90,400", "--noise", "0.4", "--blur", "0.9", "--gradient", "0.3,0.2", "-o", join(folder, "view.png"));
copyFileSync(join(folder, "view.png"), join(web, "samples", "board.png"));
rmSync(folder, { recursive: true });
