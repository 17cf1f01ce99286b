// Converts meshes of other formats to OBJ, which the library reads.
import { Mesh, type BufferGeometry } from "three";
import { STLLoader } from "three/examples/jsm/loaders/STLLoader.js";
import { mergeVertices } from "three/examples/jsm/utils/BufferGeometryUtils.js";
import { read } from "./solid";

/** Vertices closer than this fraction of the largest coordinate are merged. */
const SAME = 1e-6;

/** Returns the text of an OBJ file, in millimetres, for a dropped mesh. */
export async function inObj(name: string, bytes: Uint8Array): Promise<string> {
  if (/\.obj$/i.test(name)) return new TextDecoder().decode(bytes);
  if (/\.stl$/i.test(name)) return written([new STLLoader().parse(bytes.slice().buffer)], 1);
  const parts: BufferGeometry[] = [];
  const object = await read(bytes);
  object.updateWorldMatrix(true, true);
  object.traverse((part) => {
    if (part instanceof Mesh) parts.push((part.geometry as BufferGeometry).clone().applyMatrix4(part.matrixWorld));
  });
  // glTF uses metres.
  return written(parts, 1000);
}

function written(parts: BufferGeometry[], scale: number): string {
  const lines: string[] = [];
  let first = 1;
  for (const part of parts) {
    for (const attribute of Object.keys(part.attributes)) if (attribute !== "position") part.deleteAttribute(attribute);
    const largest = Math.max(...extent(part));
    const merged = mergeVertices(part, SAME * largest);
    const at = merged.getAttribute("position");
    for (let i = 0; i < at.count; i++) lines.push(`v ${at.getX(i) * scale} ${at.getY(i) * scale} ${at.getZ(i) * scale}`);
    const index = merged.index;
    if (index) for (let i = 0; i + 2 < index.count; i += 3) lines.push(`f ${index.getX(i) + first} ${index.getX(i + 1) + first} ${index.getX(i + 2) + first}`);
    first += at.count;
  }
  return `${lines.join("\n")}\n`;
}

function extent(part: BufferGeometry): number[] {
  part.computeBoundingBox();
  const box = part.boundingBox;
  return box ? [...box.min.toArray(), ...box.max.toArray()].map(Math.abs) : [1];
}
