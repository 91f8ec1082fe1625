// The room: table, floor, light. Metres, y up; the playing surface's middle is at the origin of the stage.
import {
  BackSide,
  BoxGeometry,
  CircleGeometry,
  Color,
  DirectionalLight,
  Fog,
  HemisphereLight,
  Mesh,
  MeshBasicMaterial,
  MeshStandardMaterial,
  PMREMGenerator,
  Scene,
  SphereGeometry,
  type WebGLRenderer,
} from "three";
import { softBox } from "./furniture";
import { OAK, SMOKED, woodTexture } from "./wood";
import type { Geometry } from "./types";

export type Theme = "light" | "dark";

interface Mood {
  readonly wall: string;
  readonly floor: string;
  readonly key: string;
  readonly keyStrength: number;
  readonly fill: string;
  readonly fillStrength: number;
  readonly ground: string;
  readonly surroundings: number;
  readonly exposure: number;
}

const MOODS: Record<Theme, Mood> = {
  light: { wall: "#e9e3d8", floor: "#d9d1c3", key: "#fff3e2", keyStrength: 2.3, fill: "#dfe8f5", fillStrength: 0.3, ground: "#8a7a66", surroundings: 0.66, exposure: 1.12 },
  dark: { wall: "#14130f", floor: "#191713", key: "#ffdcae", keyStrength: 2.6, fill: "#7f90b8", fillStrength: 0.2, ground: "#2a2018", surroundings: 0.36, exposure: 1.4 },
};

/** Of the playing surface above the floor, m. */
export const TABLE_HEIGHT = 0.76;

export class Room {
  readonly scene = new Scene();
  readonly key = new DirectionalLight();
  readonly #fill = new HemisphereLight();
  readonly #rim = new DirectionalLight();
  readonly #floor = new Mesh(new CircleGeometry(9, 48), new MeshStandardMaterial({ roughness: 0.95 }));
  readonly #top = new MeshStandardMaterial({ roughness: 0.62 });
  readonly #woods = { light: woodTexture(OAK, 3, [2, 3], 1024), dark: woodTexture(SMOKED, 3, [2, 3], 1024) };

  /** @param rich Whether metal and varnish mirror a room: too much for a processor that draws by itself. */
  constructor(
    private readonly renderer: WebGLRenderer,
    private readonly rich: boolean,
  ) {
    this.#floor.rotation.x = -Math.PI / 2;
    this.#floor.receiveShadow = true;
    this.scene.add(this.#floor, this.#fill, this.key, this.key.target);
    this.key.castShadow = true;
    this.key.shadow.mapSize.setScalar(rich ? 2048 : 1024);
    if (!rich) this.scene.add(this.#rim);
    this.key.shadow.radius = 5;
    this.key.shadow.bias = -0.0004;
    this.key.shadow.normalBias = 0.0015;
  }

  /** Table top below everything that the gantry needs, and light that covers it. */
  furnish(geometry: Geometry): void {
    const { lower, upper } = geometry.space;
    const [wide, deep] = [(upper[0] - lower[0]) / 1000 + 0.42, (upper[1] - lower[1]) / 1000 + 0.36];
    const level = TABLE_HEIGHT - geometry.board.thickness / 1000;
    const old = this.scene.getObjectByName("table");
    if (old) this.scene.remove(old);
    const top = new Mesh(softBox(wide * 1000, deep * 1000, 32, 6).rotateX(-Math.PI / 2).scale(0.001, 0.001, 0.001), this.#top);
    scaleUv(top, 1 / 900);
    top.name = "table";
    top.position.y = level - 0.016;
    top.castShadow = top.receiveShadow = true;
    for (const [x, z] of [[-1, -1], [-1, 1], [1, -1], [1, 1]] as const) {
      const leg = new Mesh(new BoxGeometry(0.05, level - 0.03, 0.05), this.#top);
      leg.position.set(x * (wide / 2 - 0.08), -(level - 0.03) / 2 - 0.016, z * (deep / 2 - 0.08));
      top.add(leg);
    }
    this.scene.add(top);
    this.#aim(Math.max(wide, deep) / 2 + 0.06);
  }

  #aim(reach: number): void {
    this.key.position.set(-0.62, TABLE_HEIGHT + 1.25, 0.5);
    this.key.target.position.set(0, TABLE_HEIGHT, 0);
    const camera = this.key.shadow.camera;
    [camera.left, camera.right, camera.top, camera.bottom] = [-reach, reach, reach, -reach];
    [camera.near, camera.far] = [0.4, 2.4];
    camera.updateProjectionMatrix();
  }

  light(theme: Theme): void {
    const mood = MOODS[theme];
    this.scene.background = new Color(mood.wall);
    this.scene.fog = new Fog(mood.wall, 2.6, 7);
    this.#floor.material.color.set(mood.floor);
    this.#top.map = this.#woods[theme];
    this.#top.needsUpdate = true;
    this.key.color.set(mood.key);
    this.key.intensity = mood.keyStrength;
    this.#fill.color.set(mood.fill);
    this.#fill.groundColor.set(mood.ground);
    this.#fill.intensity = this.rich ? mood.fillStrength : mood.fillStrength + 1.9 * mood.surroundings;
    this.#rim.color.set(mood.fill);
    this.#rim.intensity = 0.9 * mood.surroundings;
    this.#rim.position.set(0.9, TABLE_HEIGHT + 0.7, -0.8);
    this.renderer.toneMappingExposure = mood.exposure;
    if (!this.rich) return;
    this.scene.environment?.dispose();
    this.scene.environment = surroundings(this.renderer, theme);
    this.scene.environmentIntensity = mood.surroundings;
  }

  dispose(): void {
    this.scene.environment?.dispose();
    this.key.dispose();
    for (const wood of Object.values(this.#woods)) wood.dispose();
  }
}

/** Whether a graphics card draws, as far as the browser tells. */
export function hasGraphicsCard(renderer: WebGLRenderer): boolean {
  const gl = renderer.getContext();
  const names = gl.getExtension("WEBGL_debug_renderer_info");
  const name = String(gl.getParameter(names ? names.UNMASKED_RENDERER_WEBGL : gl.RENDERER));
  return !/swiftshader|llvmpipe|software|basic render/i.test(name);
}

function scaleUv(mesh: Mesh, scale: number): void {
  const uv = mesh.geometry.getAttribute("uv");
  for (let i = 0; i < uv.count; i++) uv.setXY(i, uv.getX(i) * scale, uv.getY(i) * scale);
}

/** What metal and varnish mirror: a dim room with a large window, a strip of light and a warm lamp. */
function surroundings(renderer: WebGLRenderer, theme: Theme): ReturnType<PMREMGenerator["fromScene"]>["texture"] {
  const scene = new Scene();
  const dim = theme === "dark" ? 0.35 : 1;
  scene.add(new Mesh(new SphereGeometry(10, 24, 16), new MeshBasicMaterial({ color: new Color(0.62, 0.6, 0.57).multiplyScalar(dim), side: BackSide })));
  const panel = (w: number, h: number, x: number, y: number, z: number, colour: Color): void => {
    const mesh = new Mesh(new BoxGeometry(w, h, 0.1), new MeshBasicMaterial({ color: colour }));
    mesh.position.set(x, y, z);
    mesh.lookAt(0, 0, 0);
    scene.add(mesh);
  };
  panel(6, 4, -5, 5, 3, new Color(5.2, 5, 4.6));
  panel(1.2, 7, 6, 3, -2, new Color(3.4, 3.5, 3.8));
  panel(5, 0.8, 0, 4, -7, new Color(3.2, 2.9, 2.4));
  panel(12, 12, 0, -6, 0, new Color(0.34, 0.29, 0.24).multiplyScalar(dim));
  const generator = new PMREMGenerator(renderer);
  const { texture } = generator.fromScene(scene, 0.035);
  generator.dispose();
  return texture;
}
