// Names for screen readers, folders for keyboards, the key "?", and the end of drags whose
// release is not seen: what viser lacks.
"use strict";
(() => {
  const HELP = "Keys and gestures";
  const SYMBOLS = { "search": "Search commands", "adjustments": "Settings of the page",
                    "arrow-back": "Back to the panel" };  // of Tabler's icons

  addEventListener("keydown", e => {
    if (e.key !== "?" || e.target.closest?.("input:not([type=checkbox]), textarea")) return;
    const buttons = [...document.querySelectorAll("button")];
    buttons.find(b => b.textContent.trim() === HELP)?.click();
  });

  // viser ends a drag by `pointerup` alone. A page that is hidden, or whose pointer was
  // released elsewhere, does not get it: the handle would stick to the pointer.
  const pressed = new Map();  // the element that each pointer was pressed on
  function letGo(id) {
    const target = pressed.get(id);
    pressed.delete(id);
    target?.dispatchEvent(new PointerEvent("pointerup", { pointerId: id, bubbles: true }));
  }
  function letGoAll() { for (const id of [...pressed.keys()]) letGo(id); }
  addEventListener("pointerdown", e => {
    if (e.target.tagName === "CANVAS") pressed.set(e.pointerId, e.target);
  }, true);
  addEventListener("pointerup", e => pressed.delete(e.pointerId), true);
  addEventListener("pointercancel", e => letGo(e.pointerId), true);
  addEventListener("pointermove", e => { if (!e.buttons) letGo(e.pointerId); }, true);
  addEventListener("pagehide", letGoAll);
  document.addEventListener("visibilitychange", () => { if (document.hidden) letGoAll(); });

  // The label of the row that an element stands in.
  function labelOf(element) {
    for (let e = element.parentElement; e; e = e.parentElement) {
      const label = e.querySelector("label[for]")?.textContent.trim();
      if (label) return label;
    }
    return "";
  }
  function name(element, text) {
    if (text && element.getAttribute("aria-label") !== text)
      element.setAttribute("aria-label", text);
  }
  function symbol(button) {
    const icon = button.querySelector("svg")?.getAttribute("class") || "";
    return Object.entries(SYMBOLS).find(([part]) => icon.includes(part))?.[1];
  }
  function makeFolder(title) {
    const content = title.nextElementSibling;
    title.setAttribute("role", "button");
    title.setAttribute("tabindex", "0");
    title.setAttribute("aria-expanded", content?.getAttribute("aria-hidden") !== "true");
  }
  function nameAll() {
    waiting = false;
    const all = selector => document.querySelectorAll(selector);
    document.getElementById("root")?.setAttribute("role", "main");
    for (const e of all("[role=slider]:not([aria-label]), [role=slider][aria-label='']"))
      name(e, labelOf(e));
    for (const e of all(".mantine-Input-input:not([aria-label])"))
      if (!e.labels?.length) name(e, labelOf(e));
    for (const e of all(".mantine-ScrollArea-content img:not([alt])")) e.alt = "Camera picture";
    for (const e of all(".mantine-CloseButton-root")) name(e, "Close");
    for (const e of all(".mantine-ActionIcon-root:not([aria-label])")) name(e, symbol(e));
    for (const e of all(".mantine-Flex-root:has(> .mantine-Button-root)")) {
      e.setAttribute("role", "group");
      if (!e.hasAttribute("aria-label")) name(e, labelOf(e));
      if (e.textContent.includes("•"))
        for (const button of e.children)
          button.setAttribute("aria-pressed", button.textContent.startsWith("•"));
    }
    for (const e of all("[data-with-border] > .mantine-Paper-root")) makeFolder(e);
  }
  addEventListener("keydown", e => {
    const folder = e.target.closest?.("[data-with-border] > .mantine-Paper-root");
    if (!folder || !["Enter", " "].includes(e.key)) return;
    e.preventDefault();
    folder.click();
  });

  let waiting = false;
  function nameSoon() {
    if (!waiting) { waiting = true; setTimeout(nameAll, 200); }
  }
  addEventListener("DOMContentLoaded", () => {
    new MutationObserver(nameSoon).observe(document.body, { childList: true, subtree: true });
    nameSoon();
  });
})();
