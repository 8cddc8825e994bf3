// From the axes of WebXR (x right, y up, z back) to those of the robot's world
// (x forward, y left, z up), and the place of the user in that world.

const rounded = x => Math.round(x * 1e5) / 1e5;

/** A point of WebXR as [x, y, z] in the axes of the robot, m. */
export const point = p => [-p.z, -p.x, p.y];

/** The angle about the vertical that a WebXR orientation faces, rad. */
export function heading(q) {
  const x = 2 * (q.x * q.z + q.w * q.y), z = 1 - 2 * (q.x * q.x + q.y * q.y);
  return Math.atan2(x, z);  // 0 along -z, positive to the left
}

/** Where the user's space is in the robot's world: a turn about z, then a shift. */
export class Placement {
  constructor(turn = 0, shift = [0, 0, 0]) {
    this.turn = turn;
    this.shift = shift;
  }

  /** The placement that puts a WebXR pose at `eye`, m, facing `turn`, rad. */
  static at(transform, eye, turn) {
    const own = new Placement(turn - heading(transform.orientation));
    const at = own.apply(point(transform.position));
    return new Placement(own.turn, eye.map((x, k) => x - at[k]));
  }

  apply([x, y, z]) {
    const c = Math.cos(this.turn), s = Math.sin(this.turn), [a, b, d] = this.shift;
    return [c * x - s * y + a, s * x + c * y + b, z + d];
  }

  /** A WebXR transform as the pose of a frame: position, and quaternion w x y z. */
  pose(transform) {
    const q = transform.orientation, [w, x, y, z] = [q.w, -q.z, -q.x, q.y];
    const c = Math.cos(this.turn / 2), s = Math.sin(this.turn / 2);
    return {
      position: this.apply(point(transform.position)).map(rounded),
      orientation: [c * w - s * z, c * x - s * y, c * y + s * x, c * z + s * w],
    };
  }
}

/** Points of WebXR in the axes of the robot, rounded for sending. */
export const points = list => list.map(p => point(p).map(rounded));
