// What viser's page lacks for the keyboard and for screen readers: sections that open by a key, names of controls,
// arrow keys that stay with the slider they are pressed on, and number boxes that show what they hold.
const root = document.getElementById("root");
root.setAttribute("role", "main");
root.addEventListener("keydown", event => {
  // What listens for keys on the whole document, viser's commands and its camera, does not hear of it.
  if (event.key.startsWith("Arrow") && event.target.closest("[role=slider]")) event.stopPropagation();
});

// Of an emptied number box, or one with half a number, viser sends nothing: the last number goes on holding, and the box
// shows it again when it is left.
const held = new WeakMap();
const isNumber = text => text.trim() !== "" && Number.isFinite(Number(text));
root.addEventListener("beforeinput", event => {
  const box = event.target;
  if (box.matches(".mantine-NumberInput-input") && isNumber(box.value)) held.set(box, box.value);
});
root.addEventListener("focusout", event => {
  const box = event.target;
  if (!held.has(box) || isNumber(box.value)) return;
  // By the element's own setter and an event, so that viser's framework takes it for typed.
  Object.getOwnPropertyDescriptor(HTMLInputElement.prototype, "value").set.call(box, held.get(box));
  box.dispatchEvent(new Event("input", { bubbles: true }));
});

// Heads of viser's sections, open or not.
export function sectionHeads() {
  const boxes = document.querySelectorAll("#root .mantine-Paper-root > .mantine-Paper-root");
  return [...boxes].filter(box => box.style.cursor === "pointer");
}

const ICONS = { "list-search": "Commands", "adjustments": "Settings of the view", "arrow-back": "Back" };

// viser's sections open by a click on their head only.
function makeButton(head) {
  head.tabIndex = 0;
  head.setAttribute("role", "button");
  head.addEventListener("keydown", event => {
    if (event.target !== head || (event.key !== "Enter" && event.key !== " ")) return;
    event.preventDefault();
    event.stopPropagation();
    head.click();
  });
}

// A label of viser names its field at best, and not the slider and the box that stand for it.
function nameRow(label) {
  const row = label.closest("div")?.parentElement;
  for (const one of row?.querySelectorAll("[role=slider], input, textarea") ?? []) {
    if (!one.getAttribute("aria-label") && !one.labels?.length) one.setAttribute("aria-label", label.textContent);
  }
}

function look() {
  for (const head of sectionHeads()) {
    if (head.tabIndex < 0) makeButton(head);
    head.setAttribute("aria-expanded", String(head.querySelector(".tabler-icon-chevron-up") !== null));
  }
  for (const label of document.querySelectorAll("#root label")) nameRow(label);
  for (const [icon, name] of Object.entries(ICONS)) {
    for (const found of document.querySelectorAll(`#root .tabler-icon-${icon}`)) {
      const button = found.closest("button");
      if (button && !button.textContent.trim()) button.setAttribute("aria-label", name);
    }
  }
  for (const button of document.querySelectorAll(".mantine-CloseButton-root:not([aria-label])")) {
    button.setAttribute("aria-label", "Close");
  }
}

let waiting = 0;
new MutationObserver(() => {
  if (waiting) return;
  waiting = setTimeout(() => { waiting = 0; look(); }, 300);
}).observe(root, { childList: true, subtree: true });
