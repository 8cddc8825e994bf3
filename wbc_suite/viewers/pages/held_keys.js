// Tells the server which way the user drives while keys, buttons or sticks are held.
// A message is [forward, left, turn, up], -1 .. 1, repeated until all are released.
// Whatever is held while the connection drops, or while the page is hidden or loses its
// focus, counts as released: it has to be pressed anew. So does what is held when a page
// connects: the first message is zeros. Sticks of a gamepad count while ENABLE is held.
// Nothing counts before the page has a pad, an element with `data-drive`.
"use strict";
(() => {
  const PERIOD = 100, DEAD = 0.12;  // ms; dead zone of a stick
  const ENABLE = 4;  // L1 or LB, in the browsers' standard mapping
  const AXES = { KeyW: [0, 1], KeyS: [0, -1], KeyA: [1, 1], KeyD: [1, -1],
                 KeyQ: [2, 1], KeyE: [2, -1], KeyR: [3, 1], KeyF: [3, -1] };
  const keys = new Set(), pointers = new Map();
  let socket = null, last = "", ready = false;  // whether the next press of ENABLE counts

  const style = document.createElement("style");
  style.textContent = `
    [data-drive] { font: inherit; touch-action: none; user-select: none; cursor: pointer;
      border: 1px solid rgba(120,140,160,.45); border-radius: .3em; padding: .3em 0;
      background: rgba(120,140,160,.10); color: inherit; }
    [data-drive]:hover { background: rgba(120,140,160,.22); }
    [data-drive]:disabled { opacity: .3; cursor: default; }
    [data-drive].held { background: #266284; border-color: #266284; color: white; }`;
  document.head.append(style);

  function stick(x) {
    return Math.abs(x) < DEAD ? 0 : Math.sign(x) * (Math.abs(x) - DEAD) / (1 - DEAD);
  }
  function axes() {
    const sum = [0, 0, 0, 0], held = new Set([...keys, ...pointers.values()]);
    for (const key of held) sum[AXES[key][0]] += AXES[key][1];
    const pad = [...navigator.getGamepads()].find(p => p && p.mapping === "standard");
    if (!pad || !pad.buttons[ENABLE].pressed) ready = true;
    else if (ready && document.hasFocus()) [1, 0, 2, 3].forEach((axis, k) => { sum[k] -= stick(pad.axes[axis]); });
    return sum.map(x => Math.min(Math.max(x, -1), 1));
  }
  function send() {
    const now = axes(), text = JSON.stringify(now);
    if (socket?.readyState !== 1 || (text === last && !now.some(x => x))) return;
    if (socket.bufferedAmount < 4096) { socket.send(text); last = text; }
  }
  function update() {
    const held = new Set([...keys, ...pointers.values()]);
    for (const button of document.querySelectorAll("[data-drive]"))
      button.classList.toggle("held", held.has(button.dataset.drive));
    send();
  }
  function releaseAll() { keys.clear(); pointers.clear(); ready = false; update(); }

  const isText = e => e.target.closest?.("input:not([type=checkbox]), textarea, select, [contenteditable=true]");
  addEventListener("keydown", e => {
    if (!socket || !(e.code in AXES) || e.ctrlKey || e.metaKey || e.altKey || isText(e)) return;
    e.stopPropagation();  // the same keys would move the camera
    if (!e.repeat) { keys.add(e.code); update(); }
  }, true);
  addEventListener("keyup", e => {
    if (e.key === "Meta") releaseAll();  // browsers report no releases while it is held
    else if (keys.delete(e.code)) update();
  }, true);
  addEventListener("pointerdown", e => {
    const button = e.target.closest?.("[data-drive]");
    if (!button || button.disabled || e.button > 0) return;
    e.preventDefault();
    button.setPointerCapture(e.pointerId);
    pointers.set(e.pointerId, button.dataset.drive);
    update();
  }, true);
  for (const end of ["pointerup", "pointercancel", "lostpointercapture"])
    addEventListener(end, e => { if (pointers.delete(e.pointerId)) update(); }, true);
  addEventListener("blur", e => { if (e.target === window) releaseAll(); });
  addEventListener("pagehide", releaseAll);
  document.addEventListener("visibilitychange", () => { if (document.hidden) releaseAll(); });

  function connect() {
    socket = new WebSocket(location.origin.replace("http", "ws") + "/held_keys");
    socket.onopen = () => { last = ""; releaseAll(); };
    socket.onclose = () => { releaseAll(); setTimeout(connect, 1000); };
  }
  setInterval(() => {
    if (socket) send();
    else if (document.querySelector("[data-drive]")) connect();
  }, PERIOD);
})();
