// A textured solid, rotated by hand and unfolded into its net.
import { AmbientLight, Box3, type BufferAttribute, DirectionalLight, Matrix4, Mesh, type Object3D, PerspectiveCamera, Scene, Vector3, WebGLRenderer } from "three";
import { OrbitControls } from "three/examples/jsm/controls/OrbitControls.js";
import { GLTFLoader } from "three/examples/jsm/loaders/GLTFLoader.js";
import type { Hinge } from "./worker";

/** Height of the view as a fraction of its width, and of the window, so that its controls stay visible. */
const HIGH = 0.8;
const OF_WINDOW = 0.6;

/** Duration of folding or unfolding, ms. */
const PLAY_MS = 1800;

/** Camera distance as a multiple of the diagonal of the bounding box. */
const AWAY = 1.35;

const METRES = 1e-3;

let renderer: WebGLRenderer | null = null;

export type Folding = {
  /** Unfolds by a fraction: 0 is the solid, 1 the net. */
  unfold(part: number): void;
  /** Unfolds smoothly to a fraction and reports each step; at once for users who prefer reduced motion. */
  play(to: number, step: (part: number) => void): void;
  /** Fits the view into the available space. */
  fit(): void;
  /** Frees its graphics memory. */
  end(): void;
};

export function read(bytes: Uint8Array): Promise<Object3D> {
  return new Promise((resolve, reject) => new GLTFLoader().parse(bytes.slice().buffer, "", (gltf) => resolve(gltf.scene), reject));
}

/** The motion of each face from the solid to its position when unfolded by a fraction. */
function motions(hinges: Hinge[], part: number): Map<number, Matrix4> {
  const found = new Map<number, Matrix4>();
  for (const { face, on, ends_mm, angle_rad } of hinges) {
    const before = on === null ? undefined : found.get(on);
    const [from, to] = ends_mm.map((end) => new Vector3(...end).multiplyScalar(METRES));
    if (!before || !from || !to) {
      found.set(face, new Matrix4());
      continue;
    }
    const turn = new Matrix4().makeRotationAxis(to.clone().sub(from).normalize(), angle_rad * part);
    const about = new Matrix4().makeTranslation(from).multiply(turn).multiply(new Matrix4().makeTranslation(from.clone().negate()));
    found.set(face, before.clone().multiply(about));
  }
  return found;
}

export async function showMesh(place: HTMLElement, glb: Uint8Array, hinges: Hinge[], label: string): Promise<Folding> {
  const object = await read(glb);
  renderer ??= new WebGLRenderer({ antialias: true, alpha: true });
  const screen = renderer;
  const canvas = screen.domElement;
  canvas.setAttribute("aria-label", label);
  canvas.setAttribute("role", "img");
  canvas.tabIndex = 0;
  if (canvas.parentElement !== place) place.replaceChildren(canvas);
  const scene = new Scene();
  scene.add(object, new AmbientLight(0xffffff, 2.2));
  const camera = new PerspectiveCamera(35, 1 / HIGH);
  const light = new DirectionalLight(0xffffff, 1.2);
  camera.add(light);
  scene.add(camera);
  const controls = new OrbitControls(camera, canvas);
  controls.listenToKeyEvents(canvas);
  const draw = () => screen.render(scene, camera);
  const fit = () => {
    const side = Math.max(Math.min(place.clientWidth, (OF_WINDOW / HIGH) * window.innerHeight), 200);
    screen.setPixelRatio(window.devicePixelRatio);
    screen.setSize(side, side * HIGH);
    draw();
  };

  const meshes: Mesh[] = [];
  object.traverse((part) => part instanceof Mesh && meshes.push(part));
  const places = meshes.map((mesh) => {
    const position = mesh.geometry.getAttribute("position") as BufferAttribute;
    const normal = mesh.geometry.getAttribute("normal") as BufferAttribute;
    return { position, normal, positions: Float32Array.from(position.array), normals: Float32Array.from(normal.array) };
  });

  /** Viewing direction, kept as the user rotated it. */
  let towards = new Vector3(0.9, 0.7, 1.2).normalize();
  function look(): void {
    const box = new Box3().setFromObject(object, true);
    const size = box.getSize(new Vector3()).length();
    const middle = box.getCenter(new Vector3());
    camera.near = size / 100;
    camera.far = size * 10;
    camera.updateProjectionMatrix();
    camera.position.copy(middle).addScaledVector(towards, size * AWAY);
    controls.target.copy(middle);
    controls.update();
  }

  let playing = 0;
  let unfolded = 0;
  function unfold(part: number): void {
    cancelAnimationFrame(playing);
    move(part);
  }

  function play(to: number, step: (part: number) => void): void {
    cancelAnimationFrame(playing);
    const [from, begin] = [unfolded, performance.now()];
    const ms = matchMedia("(prefers-reduced-motion: reduce)").matches ? 0 : PLAY_MS * Math.abs(to - from);
    const frame = (now: number) => {
      const time = ms === 0 ? 1 : Math.min(Math.max(now - begin, 0) / ms, 1);
      const part = from + (to - from) * time * time * (3 - 2 * time);
      move(part);
      step(part);
      if (time < 1) playing = requestAnimationFrame(frame);
    };
    playing = requestAnimationFrame(frame);
  }

  function move(part: number): void {
    unfolded = part;
    towards = camera.position.clone().sub(controls.target).normalize();
    const moved = motions(hinges, part);
    const at = new Vector3();
    for (const { position, normal, positions, normals } of places) {
      for (let vertex = 0; vertex < position.count; vertex++) {
        // Three vertices for each face, in the order of the faces.
        const motion = moved.get(Math.floor(vertex / 3)) ?? new Matrix4();
        at.fromArray(positions, 3 * vertex).applyMatrix4(motion);
        position.setXYZ(vertex, at.x, at.y, at.z);
        at.fromArray(normals, 3 * vertex).transformDirection(motion);
        normal.setXYZ(vertex, at.x, at.y, at.z);
      }
      position.needsUpdate = normal.needsUpdate = true;
    }
    look();
    draw();
  }

  controls.addEventListener("change", draw);
  window.addEventListener("resize", fit);
  look();
  fit();
  return {
    unfold,
    play,
    fit,
    end() {
      cancelAnimationFrame(playing);
      window.removeEventListener("resize", fit);
      controls.dispose();
      for (const mesh of meshes) {
        mesh.geometry.dispose();
        for (const material of [mesh.material].flat()) {
          if ("map" in material && material.map) (material.map as { dispose(): void }).dispose();
          material.dispose();
        }
      }
    },
  };
}
