// A WebXR session: reads head and hands once for each picture, sends them, draws.

import { Placement } from "./axes.js";
import { Hand, readControls } from "./hands.js";

const RIDE = 0.04;  // of the way to the robot's place, for each picture

export class Session {
  constructor(view, connection) {
    this.view = view;
    this.connection = connection;
    this.hands = { right: new Hand("right"), left: new Hand("left") };
    this.status = {};
    this.session = null;
  }

  /** Enter `immersive-vr` or `immersive-ar`; `onEnd` is called afterwards. */
  async begin(mode, onEnd) {
    const session = await navigator.xr.requestSession(mode, {
      requiredFeatures: ["local-floor"], optionalFeatures: ["hand-tracking"],
    });
    const { view } = this;
    view.background(mode !== "immersive-ar");
    view.home = null;
    this.session = session;
    session.addEventListener("end", () => {
      this.session = null;
      view.background(true);
      view.renderer.setAnimationLoop(null);
      onEnd();
    });
    await view.renderer.xr.setSession(session);
    // Its user was moved: hands start again from where they are now.
    view.renderer.xr.getReferenceSpace().addEventListener("reset", () => { view.home = null; });
    view.renderer.setAnimationLoop((time, frame) => frame && this.draw(frame));
  }

  draw(frame) {
    const { view } = this, space = view.renderer.xr.getReferenceSpace();
    const viewer = frame.getViewerPose(space);
    if (viewer) {
      if (!view.home) {
        view.align(viewer.transform);
        for (const hand of Object.values(this.hands)) hand.release();
      }
      view.ride(RIDE);
      const placement = view.placement();
      view.arrange(placement);
      view.note.follow(viewer.transform);
      this.connection.send(this.read(frame, space, placement, viewer));
    }
    for (const [side, hand] of Object.entries(this.hands)) {
      const state = this.stateOf(side);
      view.hands[side].update(hand, state);
      hand.warn(this.sourceOf(side), state);
    }
    view.renderer.render(view.scene, view.camera);
  }

  read(frame, space, placement, viewer) {
    const visible = this.session.visibilityState === "visible";
    if (!visible) this.letGo();
    const limbs = { head: { pose: this.headPlacement(placement).pose(viewer.transform) } };
    for (const [side, hand] of Object.entries(this.hands))
      limbs[side] = hand.read(visible ? this.sourceOf(side) : null, frame, space, placement);
    return {
      format: "wbc-pose-frame/1", time: performance.now() / 1e3, limbs,
      ...(visible ? readControls(this.session.inputSources) : {}),
    };
  }

  // The robot's head follows turns of the user's, not of the robot that carries the user.
  headPlacement(placement) {
    return this.head = this.head || new Placement(placement.turn, placement.shift);
  }

  sourceOf(side) {
    const own = [...this.session.inputSources].filter(source => source.handedness === side);
    return own.find(source => source.hand) || own.find(source => source.gamepad) || null;
  }

  stateOf(side) {
    const names = Object.entries(this.status.hands || {});
    const found = names.find(([name]) => name.split("_").includes(side));
    return found && found[1].state;
  }

  /** Let the robot go: the user has to engage each hand anew. */
  letGo() {
    for (const hand of Object.values(this.hands)) hand.letGo();
  }

  end() {
    if (this.session) this.session.end();
  }
}
