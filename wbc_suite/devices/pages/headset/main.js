// The page before and beside the session: what is possible here, and what to do.

import { Connection } from "./connection.js";
import { parseScene, View } from "./scene.js";
import { Session } from "./session.js";

const $ = id => document.getElementById(id);
const view = new View($("picture"));
const connection = new Connection({
  onPoses: poses => { view.move(poses); view.moved = true; },
  onStatus: show,
  onChange: connected => {
    $("link").textContent = connected ? "Connected to the robot" : "Waiting for the robot";
    $("link").className = connected ? "good" : "bad";
    document.body.dataset.connected = connected;
    if (connected && !view.description) load();
    if (connected) return;
    session.letGo();
    view.show({ text: "Connection lost: the robot stops", colour: "#d23b3b" });
  },
});
const session = new Session(view, connection);
window.headset = session;  // for the browser's console

async function load() {
  const answer = await fetch("scene");
  if (answer.status === 200) {
    view.load(parseScene(await answer.arrayBuffer()));
    $("title").textContent = view.description.title;
    document.title = `Headset: ${view.description.title}`;
    document.body.dataset.scene = "loaded";
  } else setTimeout(load, 1000);  // the robot is still being prepared
}

function show(status) {
  if (status.error !== undefined) {
    $("note").textContent = status.error;
    return;
  }
  session.status = status;
  view.show(status);
  $("status").textContent = status.text || "";
  $("status").style.color = status.colour || "";
}

function drawPreview() {
  requestAnimationFrame(drawPreview);
  const { clientWidth: width, clientHeight: height } = $("picture");
  const size = `${width}x${height}`;
  if (session.session || !view.description || !(view.moved || size !== view.size)) return;
  [view.moved, view.size] = [false, size];
  view.ride(1);
  view.preview(width, height);
}
drawPreview();

function offer(button, mode) {
  button.hidden = false;
  button.onclick = async () => {
    $("note").textContent = "";
    try {
      await session.begin(mode, () => { document.body.dataset.session = ""; });
      document.body.dataset.session = mode;
    } catch (error) {
      $("note").textContent = `The session did not start: ${error.message}`;
    }
  };
}

async function supported(mode) {
  try {
    return Boolean(navigator.xr) && await navigator.xr.isSessionSupported(mode);
  } catch { return false; }
}

async function look() {
  if (!window.isSecureContext) {
    $("note").textContent = "Browsers allow WebXR only on secure pages. Use one of the three ways below.";
    return;
  }
  const [vr, ar] = [await supported("immersive-vr"), await supported("immersive-ar")];
  if (vr) offer($("vr"), "immersive-vr");
  if (ar) offer($("ar"), "immersive-ar");
  $("away").hidden = vr || ar;
  $("ready").hidden = !(vr || ar);
}
look();
if (navigator.xr) navigator.xr.addEventListener("devicechange", look);
