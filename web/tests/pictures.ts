// Test inputs, rendered by the program: photographs of a board, and a video of it for the webcam.
import { execFileSync } from "node:child_process";
import { existsSync, mkdirSync, readFileSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { fileURLToPath } from "node:url";
import { PNG } from "pngjs";

const root = fileURLToPath(new URL("../..", import.meta.url));
export const program = process.env.DELTILLE_PROGRAM ?? join(root, "target/release/deltille");
export const folder = join(root, "web/test-results/pictures");

/** Camera position, up direction and target point, mm: the board is tilted to all sides and covers the whole image. */
const VIEWS = [
  ["0,-50,420", "0,0,1", "115,60,0"],
  ["300,60,330", "0,1,0", "60,15,0"],
  ["-90,200,380", "0,1,0", "170,105,0"],
  ["250,280,350", "1,0,0", "90,60,0"],
  ["80,-160,300", "0,1,0", "60,110,0"],
  ["380,200,300", "0,0,1", "115,60,0"],
  ["100,60,330", "0,1,0", "170,10,0"],
  ["-40,20,300", "0,-1,0", "160,20,0"],
  ["180,300,300", "-1,0,0", "140,60,0"],
  ["330,-80,380", "0,1,0", "50,105,0"],
] as const;

/** A tetrahedral mesh with edges of 150 mm. */
export const tetrahedron = ((side: number) => {
  const [height, up] = [(side * Math.sqrt(3)) / 2, side * Math.sqrt(2 / 3)];
  const places = [[0, 0, 0], [side, 0, 0], [side / 2, height, 0], [side / 2, height / 3, up]];
  return `${places.map((at) => `v ${at.join(" ")}`).join("\n")}\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n`;
})(150);

export function deltille(...given: string[]): string {
  return execFileSync(program, given, { encoding: "utf8", stdio: ["ignore", "pipe", "pipe"] });
}

/** Makes a target and its files for comparison. The tests of the program verify that they show the target. */
export const drawn = (...given: string[]): string => deltille(...given, "--no-verify");

export default function make(): void {
  mkdirSync(folder, { recursive: true });
  if (existsSync(join(folder, "../webcam.y4m"))) return;
  const camera = join(root, "templates/camera.yaml");
  drawn("board", "--rows", "8", "--cols", "9", "--name", "board", "-o", folder, "--force");
  VIEWS.forEach(([eye, up, at], i) => {
    deltille("render", join(folder, "board.json"), "--camera", camera, "--eye", eye, "--up", up, "--look-at", at, "--seed", String(i), "-o", join(folder, `${i}.png`), "--force");
  });
  drawn("icosahedron", "-o", folder, "--force");
  deltille("render", join(folder, "icosahedron.json"), "--camera", camera, "--eye", "150,220,600", "-o", join(folder, "solid.png"), "--force");
  // 640 × 480 at 30 frames per second: first at the first proposed pose, then at a few others. The camera is the one that the guide
  // assumes before the first image.
  const small = join(folder, "small.yaml");
  const focal = 320 / Math.tan(1.15 / 2);
  writeFileSync(small, `width: 640\nheight: 480\nfocal_px: [${focal}, ${focal}]\ncentre_px: [319.5, 239.5]\nmodel: pinhole\ndistortion: []\n`);
  const next = join(folder, "next.json");
  mkdirSync(join(folder, "none"), { recursive: true });
  deltille("guide", join(folder, "none"), "--target", join(folder, "board.json"), "--camera", small, "--once", "-o", next, "--force");
  const { camera_from_target: pose } = JSON.parse(readFileSync(next, "utf8")) as { camera_from_target: { rotation: number[]; translation_mm: number[] } };
  // Facing the camera: a rotation by 180° about the x axis.
  if (pose.rotation[0] !== 1) throw new Error("the first proposed pose does not face the camera");
  const facing = ["--pose", [Math.PI, 0, 0, ...pose.translation_mm].join(",")];
  const places: [string[], number][] = [[facing, 45], ...["100,-60,380", "250,120,330", "-40,180,340"].map((eye): [string[], number] => [["--eye", eye], 20])];
  const frames: Buffer[] = [Buffer.from("YUV4MPEG2 W640 H480 F30:1 Ip A1:1 C420jpeg\n")];
  const chroma = Buffer.alloc((640 * 480) / 2, 128);
  places.forEach(([place, count], i) => {
    const path = join(folder, `frame-${i}.png`);
    deltille("render", join(folder, "board.json"), "--camera", small, ...place, "--seed", String(i), "-o", path, "--force");
    const grey = pixels(path);
    for (let again = 0; again < count; again++) frames.push(Buffer.from("FRAME\n"), grey, chroma);
  });
  writeFileSync(join(folder, "../webcam.y4m"), Buffer.concat(frames));
}

/** Grey values of an image. */
function pixels(path: string): Buffer {
  const { data } = PNG.sync.read(readFileSync(path));
  return Buffer.from(data.filter((_, i) => i % 4 === 0));
}

export const content = (name: string): Buffer => readFileSync(join(folder, name));
