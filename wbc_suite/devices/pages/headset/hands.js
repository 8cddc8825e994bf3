// What a hand says: its pose, its fingers or trigger, and whether the robot follows it.

import { points } from "./axes.js";

const THUMB_TIP = 4, LITTLE_TIP = 24;  // in the order of WebXR
const TOUCH = 0.016, APART = 0.035;  // m, between the tips
const PULSE_EVERY = 400;  // ms
const DEAD = 0.15;  // of a thumbstick
const WALK = 0.6, TURN = 1.0, RISE = 0.1;  // m/s, rad/s, m/s at full deflection
const BUTTONS = {  // of a controller: the upper and the lower one
  right: { 4: "keep", 5: "home" },
  left: { 4: "discard", 5: "pause" },
};
const RELEASED = { engaged: false };

const distance = (a, b) => Math.hypot(a.x - b.x, a.y - b.y, a.z - b.z);
const stick = x => Math.abs(x) < DEAD ? 0 : Math.sign(x) * (Math.abs(x) - DEAD) / (1 - DEAD);

/** One of the user's hands, bare or with a controller. */
export class Hand {
  constructor(side) {
    this.side = side;
    this.bare = false;
    this.following = false;  // a bare hand: switched by a touch of thumb and little finger
    this.touching = false;
    this.latched = null;  // where the user was when the robot began to follow
    this.waits = false;  // until squeeze is released: it was held in a lost connection
    this.joints = [];  // transforms of a bare hand, to draw it
    this.grip = null;  // transform of a controller, to draw it
    this.pulsed = 0;
  }

  get engaged() { return this.latched !== null; }

  /** Return the limb of a frame; a hand that is not seen lets the robot go. */
  read(source, frame, space, placement) {
    this.joints = [];
    this.grip = null;
    const said = source && (source.hand ? this.readBare(source, frame, space) : this.readGrip(source, frame, space));
    if (!said) return this.release();
    this.latched = said.engaged ? this.latched || placement : null;
    const { transform, ...limb } = said;
    return { ...limb, pose: (this.latched || placement).pose(transform) };
  }

  release() {
    this.latched = null;
    this.following = false;
    return RELEASED;
  }

  /** Let the robot go until the user engages anew: by the sign, or by squeezing again. */
  letGo() {
    this.release();
    this.waits = true;
  }

  readBare(source, frame, space) {
    this.bare = true;
    for (const joint of source.hand.values()) {
      const at = frame.getJointPose(joint, space);
      if (!at) { this.joints = []; return null; }
      this.joints.push(at.transform);
    }
    const places = this.joints.map(t => t.position);
    const gap = distance(places[THUMB_TIP], places[LITTLE_TIP]);
    if (!this.touching && gap < TOUCH) {
      this.touching = true;
      this.following = !this.following;
    } else if (gap > APART) this.touching = false;
    // The fingers that make the sign are not for the robot.
    const fingers = this.touching ? undefined : points(places);
    return { transform: this.joints[0], engaged: this.following, fingers };
  }

  readGrip(source, frame, space) {
    this.bare = this.following = this.touching = false;
    const at = source.gripSpace && frame.getPose(source.gripSpace, space);
    if (!at || at.emulatedPosition || !source.gamepad) return null;
    this.grip = at.transform;
    const [trigger, squeeze] = source.gamepad.buttons;
    const squeezed = Boolean(squeeze && squeeze.pressed);
    this.waits = this.waits && squeezed;
    return {
      transform: at.transform,
      engaged: squeezed && !this.waits,
      grip: 2 * (trigger ? trigger.value : 0) - 1,
    };
  }

  /** Pulse the controller while the robot's hand cannot follow. */
  warn(source, state) {
    const motor = source && source.gamepad && source.gamepad.hapticActuators && source.gamepad.hapticActuators[0];
    const now = performance.now();
    if (!motor || !this.engaged || state !== "unreachable" || now - this.pulsed < PULSE_EVERY) return;
    this.pulsed = now;
    motor.pulse(0.6, 60);
  }
}

/**
 * Return what thumbsticks and buttons command: `base`, `height`, `buttons`.
 *
 * A thumbstick counts while the trigger or squeeze of its controller is held.
 */
export function readControls(sources) {
  const base = [0, 0, 0], buttons = [];
  let height = 0;
  for (const { handedness, gamepad, hand } of sources) {
    if (!gamepad || hand || !(handedness in BUTTONS)) continue;
    const enabled = gamepad.buttons.slice(0, 2).some(button => button.pressed);
    const [x, y] = [2, 3].map(axis => enabled ? stick(gamepad.axes[axis] || 0) : 0);
    if (handedness === "left") [base[0], base[1]] = [-y * WALK, -x * WALK];
    else [base[2], height] = [-x * TURN, -y * RISE];
    for (const [index, name] of Object.entries(BUTTONS[handedness]))
      if (gamepad.buttons[index] && gamepad.buttons[index].pressed) buttons.push(name);
  }
  return { base, height, buttons };
}
