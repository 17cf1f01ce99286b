// A solid with its texture, turned by hand.
import { AmbientLight, Box3, DirectionalLight, PerspectiveCamera, Scene, Vector3, WebGLRenderer } from "three";
import { OrbitControls } from "three/examples/jsm/controls/OrbitControls.js";
import { GLTFLoader } from "three/examples/jsm/loaders/GLTFLoader.js";

let renderer: WebGLRenderer | null = null;

export function showMesh(place: HTMLElement, glb: Uint8Array, label: string): void {
  new GLTFLoader().parse(glb.slice().buffer, "", (gltf) => {
    renderer ??= new WebGLRenderer({ antialias: true, alpha: true });
    const canvas = renderer.domElement;
    canvas.setAttribute("aria-label", label);
    canvas.setAttribute("role", "img");
    canvas.tabIndex = 0;
    if (canvas.parentElement !== place) place.replaceChildren(canvas);
    const side = Math.max(place.clientWidth, 200);
    renderer.setPixelRatio(window.devicePixelRatio);
    renderer.setSize(side, side * 0.8);
    const scene = new Scene();
    scene.add(gltf.scene, new AmbientLight(0xffffff, 2.2));
    const box = new Box3().setFromObject(gltf.scene);
    const size = box.getSize(new Vector3()).length();
    const middle = box.getCenter(new Vector3());
    const camera = new PerspectiveCamera(35, 1.25, size / 100, size * 10);
    camera.position.copy(middle).add(new Vector3(0.9, 0.7, 1.2).normalize().multiplyScalar(size * 1.3));
    const light = new DirectionalLight(0xffffff, 1.2);
    camera.add(light);
    scene.add(camera);
    const controls = new OrbitControls(camera, canvas);
    controls.target.copy(middle);
    controls.listenToKeyEvents(canvas);
    const draw = () => renderer?.render(scene, camera);
    controls.addEventListener("change", draw);
    controls.update();
    draw();
  });
}
