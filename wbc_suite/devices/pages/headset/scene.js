// The robot and its surroundings, the user's hands and a line of text, drawn by three.

import * as THREE from "./three.js";
import { Placement } from "./axes.js";

export const COLOURS = {
  released: 0x8a96a5, following: 0x23935a, limited: 0xd99400, unreachable: 0xd23b3b,
};
const NEAR = 0.12;  // m; the head of the robot, in which the user's eyes are, is not drawn
const EYE_HEIGHT = 1.6;  // m, of the picture before a session begins
const TEXT = { width: 1024, height: 128 };  // pixels

/** Parse the scene: its length, a JSON header, then vertices and faces. */
export function parseScene(buffer) {
  const size = new DataView(buffer).getUint32(0, true);
  const header = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 4, size)));
  let at = 4 + size;
  for (const mesh of header.meshes) {
    mesh.position = new Float32Array(buffer, at, 3 * mesh.vertices);
    mesh.normal = new Float32Array(buffer, at + 12 * mesh.vertices, 3 * mesh.vertices);
    at += 24 * mesh.vertices;
    mesh.index = new Uint32Array(buffer, at, 3 * mesh.faces);
    at += 12 * mesh.faces;
  }
  return header;
}

export class View {
  constructor(canvas) {
    this.renderer = new THREE.WebGLRenderer({ canvas, antialias: true, alpha: true });
    this.renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
    this.renderer.xr.enabled = true;
    this.renderer.xr.setReferenceSpaceType("local-floor");
    this.scene = new THREE.Scene();
    this.camera = new THREE.PerspectiveCamera(50, 1, NEAR, 60);
    this.scene.add(new THREE.HemisphereLight(0xffffff, 0x8d949e, 1.9));
    const sun = new THREE.DirectionalLight(0xffffff, 1.6);
    sun.position.set(1, 3, 2);
    this.scene.add(sun);
    this.world = new THREE.Group();  // in the axes of the robot's world
    this.world.matrixAutoUpdate = false;
    this.scene.add(this.world);
    this.floor = new THREE.GridHelper(12, 24, 0xaab4c0, 0xc9d0d8);
    this.floor.rotation.x = Math.PI / 2;
    this.world.add(this.floor);
    this.bodies = [];
    this.targets = {};
    this.hands = { right: new HandMarks(this.scene), left: new HandMarks(this.scene) };
    this.note = new Note(this.scene);
    this.poses = null;
    this.eye = [0, 0, EYE_HEIGHT];
    this.background(true);
  }

  background(drawn) {
    this.scene.background = drawn ? new THREE.Color(0xe8ecf1) : null;
    this.floor.visible = drawn;
  }

  load(description) {
    for (const body of this.bodies) this.world.remove(body);
    this.description = description;
    this.bodies = Array.from({ length: description.bodies }, () => new THREE.Group());
    for (const body of this.bodies) this.world.add(body);
    for (const mesh of description.meshes) {
      const geometry = new THREE.BufferGeometry();
      geometry.setAttribute("position", new THREE.BufferAttribute(mesh.position, 3));
      geometry.setAttribute("normal", new THREE.BufferAttribute(mesh.normal, 3));
      geometry.setIndex(new THREE.BufferAttribute(mesh.index, 1));
      const [r, g, b, opacity] = mesh.colour;
      const material = new THREE.MeshStandardMaterial({
        color: new THREE.Color().setRGB(r, g, b, THREE.SRGBColorSpace),
        roughness: 0.7, transparent: opacity < 1, opacity,
      });
      this.bodies[mesh.body].add(new THREE.Mesh(geometry, material));
    }
    for (const name of description.hands) {
      const mark = new THREE.Mesh(
        new THREE.IcosahedronGeometry(0.028, 2),
        new THREE.MeshBasicMaterial({ transparent: true, opacity: 0.45, depthTest: false }),
      );
      mark.renderOrder = 2;
      mark.visible = false;
      this.targets[name] = mark;
      this.world.add(mark);
    }
    this.ride(1);
  }

  /** Place bodies and targets: position, and quaternion w x y z, of each. */
  move(poses) {
    if (!this.description || poses.length !== 7 * (this.bodies.length + this.description.hands.length)) return;
    this.poses = poses;
    const marks = this.description.hands.map(name => this.targets[name]);
    [...this.bodies, ...marks].forEach((node, k) => {
      const [x, y, z, qw, qx, qy, qz] = poses.subarray(7 * k, 7 * k + 7);
      node.position.set(x, y, z);
      node.quaternion.set(qx, qy, qz, qw);
    });
  }

  /** The robot's place: where the user's eyes are, and where it faces. */
  place() {
    const { root, eye } = this.description;
    const [x, y, , w, qx, qy, qz] = this.poses ? this.poses.subarray(7 * root, 7 * root + 7) : [0, 0, 0, 1, 0, 0, 0];
    const turn = Math.atan2(2 * (w * qz + qx * qy), 1 - 2 * (qy * qy + qz * qz)) - this.description.heading;
    const c = Math.cos(turn), s = Math.sin(turn), [a, b, height] = eye;
    return { turn, eye: [x + c * a - s * b, y + s * a + c * b, height] };
  }

  /** Take the user along with a robot that drives; `share` of the way to its place. */
  ride(share) {
    if (!this.description) return;
    const { turn, eye } = this.place();
    this.facing = turn;
    this.eye = this.eye.map((x, k) => x + share * (eye[k] - x));
  }

  /** Put the user's eyes at the robot's. */
  align(transform) {
    this.home = transform;
    return this.placement();
  }

  placement() {
    return Placement.at(this.home, this.eye, this.facing || 0);
  }

  /** Draw the world where a placement puts it. */
  arrange(placement) {
    const c = Math.cos(placement.turn), s = Math.sin(placement.turn);
    const [x, y, z] = placement.shift;
    const toUser = new THREE.Matrix4().set(c, s, 0, -c * x - s * y, -s, c, 0, s * x - c * y, 0, 0, 1, -z, 0, 0, 0, 1);
    const toWebXR = new THREE.Matrix4().set(0, -1, 0, 0, 0, 0, 1, 0, -1, 0, 0, 0, 0, 0, 0, 1);
    this.world.matrix.multiplyMatrices(toWebXR, toUser);
    this.world.matrixWorldNeedsUpdate = true;
  }

  show(status) {
    for (const [name, mark] of Object.entries(this.targets)) {
      const hand = status.hands && status.hands[name];
      mark.visible = Boolean(hand) && hand.state !== "released";
      if (hand) mark.material.color.set(COLOURS[hand.state]);
    }
    this.note.write(status.text || "", status.colour);
  }

  /** The picture before a session: the robot from behind its shoulder. */
  preview(width, height) {
    if (this.renderer.xr.isPresenting) return;
    this.renderer.setSize(width, height, false);
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
    this.arrange(new Placement(this.facing || 0, [this.eye[0], this.eye[1], 0]));
    this.camera.position.set(-1.15, this.eye[2] + 0.35, -1.9);
    this.camera.lookAt(0, this.eye[2] - 0.5, -0.25);
    this.renderer.render(this.scene, this.camera);
  }
}

/** The joints of a bare hand, or a controller, as the user holds it. */
class HandMarks {
  constructor(scene) {
    this.material = new THREE.MeshStandardMaterial({ roughness: 0.5, transparent: true, opacity: 0.8 });
    this.joints = new THREE.InstancedMesh(new THREE.SphereGeometry(0.007, 12, 8), this.material, 25);
    this.joints.instanceMatrix.setUsage(THREE.DynamicDrawUsage);
    this.joints.frustumCulled = false;
    this.grip = new THREE.Mesh(new THREE.BoxGeometry(0.035, 0.035, 0.11), this.material);
    scene.add(this.joints, this.grip);
    this.matrix = new THREE.Matrix4();
  }

  update(hand, state) {
    this.material.color.set(COLOURS[hand.engaged ? state || "following" : "released"]);
    this.joints.visible = hand.joints.length === 25;
    hand.joints.forEach((at, k) => this.joints.setMatrixAt(k, this.matrix.fromArray(at.matrix)));
    this.joints.instanceMatrix.needsUpdate = true;
    this.grip.visible = hand.grip !== null;
    if (hand.grip) {
      this.grip.position.copy(hand.grip.position);
      this.grip.quaternion.copy(hand.grip.orientation);
    }
  }
}

/** A line of text that floats before the user, below the line of sight. */
class Note {
  constructor(scene) {
    this.canvas = Object.assign(document.createElement("canvas"), TEXT);
    this.texture = new THREE.CanvasTexture(this.canvas);
    this.texture.colorSpace = THREE.SRGBColorSpace;
    const material = new THREE.MeshBasicMaterial({ map: this.texture, transparent: true, depthTest: false });
    this.plane = new THREE.Mesh(new THREE.PlaneGeometry(0.64, 0.08), material);
    this.plane.renderOrder = 3;
    this.plane.visible = false;
    scene.add(this.plane);
    this.text = "";
  }

  write(text, colour = "#1c2733") {
    if (text === this.text && colour === this.colour) return;
    [this.text, this.colour] = [text, colour];
    this.plane.visible = text !== "";
    const pen = this.canvas.getContext("2d"), { width, height } = TEXT;
    pen.clearRect(0, 0, width, height);
    pen.font = "600 40px system-ui, sans-serif";
    const wide = Math.min(width, pen.measureText(text).width + 72);
    pen.fillStyle = colour;
    pen.beginPath();
    pen.roundRect((width - wide) / 2, 16, wide, height - 32, 36);
    pen.fill();
    pen.fillStyle = "#ffffff";
    pen.textAlign = "center";
    pen.textBaseline = "middle";
    pen.fillText(text, width / 2, height / 2, width - 60);
    this.texture.needsUpdate = true;
  }

  /** Keep the text before a head, 0.9 m away and upright. */
  follow(transform) {
    const q = new THREE.Quaternion().copy(transform.orientation);
    const ahead = new THREE.Vector3(0, 0, -1).applyQuaternion(q);
    ahead.y = 0;
    if (ahead.length() < 0.1) return;
    ahead.normalize();
    this.plane.position.copy(transform.position).addScaledVector(ahead, 0.9);
    this.plane.position.y -= 0.28;
    this.plane.lookAt(transform.position.x, transform.position.y, transform.position.z);
  }
}
