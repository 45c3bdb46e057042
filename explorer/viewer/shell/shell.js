// What stands around viser's page: the state line on top, the timeline at the bottom. States come by a WebSocket of
// their own; what is clicked goes back as a named command. Rooms are viser's own tabs, opened in this browser only.
import { sectionHeads } from "/shell/accessibility.js";
import { element } from "/shell/element.js";

const MARKS = { empty: "○", assumed: "◌", measured: "●", running: "◐", done: "✓", failed: "✕" };
const RECONNECT_MS = 1000;
const SMALL_WINDOW = 700;  // pixels, as viser's own
const LATEST_MS = 10000;  // until which what stands in a room may still come
let channel = null, sought = null;
let restoring = true;  // the rooms of the page that was left, until somebody opens one

// What is asked for while the page still connects is sent once it has; after that, only while it is connected: returns
// whether it is or will be sent.
let unsent = [];
function send(command) {
  const text = JSON.stringify(command);
  if (channel && channel.readyState === WebSocket.OPEN) channel.send(text);
  else if (unsent) unsent.push(text);
  else return false;
  return true;
}

const tabs = () => [...document.querySelectorAll("#root [role=tab]")];
const tabOf = room => tabs().find(one => one.textContent.trim() === room);
const isOpen = tab => tab.getAttribute("aria-selected") === "true";

// A tab by its name: in a panel that is open, folded to the edge of the window, or in a small window's bottom sheet.
function openRoom(name) {
  restoring = false;
  const tab = () => tabOf(name);
  const sheet = () => [...document.querySelectorAll("#root [role=button]")].find(
    one => (one.getAttribute("aria-label") || "").startsWith("Expand panel") && one.textContent.includes(name));
  const open = one => {
    press(one);
    if (window.innerWidth < SMALL_WINDOW) keepOnTop(tab);
  };
  soon(() => tab() || sheet(), found => {
    if (found.getAttribute("role") === "tab") { open(found); return; }
    press(found);
    soon(tab, open);
  });
}

// In a small window all panels stand below each other, and what stands in a room comes after its tab: it is kept on top
// until all of it can be there, somebody touches the page, or something else is sought.
function keepOnTop(find) {
  sought = find;
  const end = performance.now() + LATEST_MS;
  const again = () => {
    if (sought !== find || performance.now() > end) return;
    find()?.scrollIntoView({ block: "start" });
    setTimeout(again, 250);
  };
  setTimeout(again, 250);
}
for (const touch of ["pointerdown", "wheel", "keydown"]) {
  document.addEventListener(touch, event => {
    if (!event.isTrusted) return;
    sought = null;
    if (touch !== "wheel" && event.target.closest?.("[role=tab]")) restoring = false;
  }, { capture: true, passive: true });
}

// Does something with what is not there yet, but within seconds.
function soon(find, act, tries = 20) {
  const found = find();
  if (found) act(found);
  else if (tries) setTimeout(() => soon(find, act, tries - 1), 250);
}

// A section of the room that was just opened, once it is there: unfolded, and in sight.
function openSection(name) {
  soon(() => sectionHeads().find(one => one.textContent.trim().startsWith(name)), head => {
    sought = null;
    if (head.parentElement.getBoundingClientRect().height < 60) head.click();
    head.scrollIntoView({ block: "start" });
  });
}

// viser's movable tabs answer to a key, those inside a panel to a click.
function press(target) {
  target.focus();
  if (target.dataset.dockTab === undefined) target.click();
  else target.dispatchEvent(new KeyboardEvent("keydown", { key: "Enter", code: "Enter", bubbles: true, cancelable: true }));
}

const name = element("h1", { class: "name" });
const steps = element("ol");
const next = element("button", { class: "next", onclick: () => openRoom(next.dataset.room) });
const help = element("button", { title: "Where to begin, and keys (?)", "aria-label": "Where to begin, and keys",
  onclick: () => beginning.showModal() }, "?");
const shade = element("button", { title: "Dark or light page", "aria-label": "Dark or light page",
  onclick: () => send({ do: "theme" }) }, "◑");
document.body.append(element("header", { id: "state-line" }, name,
  element("nav", { "aria-label": "Steps of the project" }, steps), next, help, shade));

function showSteps(project) {
  name.textContent = project.name;
  const items = project.steps.map(step => element("li", {},
    element("button", { class: step.state, "aria-label": `${step.name}: ${step.said || step.state}`,
      title: step.said ? `${step.said}. ${step.hint}` : step.hint, onclick: () => openRoom(step.room) },
      element("span", { class: "mark", "aria-hidden": "true" }, MARKS[step.state]), step.name,
      ...(step.said ? [element("span", { class: "said" }, " " + step.said)] : []))));
  const focused = [...steps.querySelectorAll("button")].indexOf(document.activeElement);
  steps.replaceChildren(...items);
  if (focused >= 0) steps.querySelectorAll("button")[focused]?.focus();
  next.replaceChildren("Next: ", element("b", {}, project.next));
  next.title = project.next;
  next.dataset.room = project.next_room;
}

// The first visit of a browser begins with four ways to begin; later they are behind "?".
const WAYS = [
  ["I have a grain and a photograph", "On the left, read the angle off a photograph of your pile and make it the " +
    "target. On the right, give the grain's shape and sizes and pour it; its file, once kept, is calibrated against it.",
    ["Set-up", "A grain of your own"], ["Laboratory", "Photograph"]],
  ["Just play", "Watch a pile form, and move its friction, stiffness and restitution.", ["Controls"]],
  ["Plan an experiment", "A screening or response-surface design as a sheet to fill in, with its power told before you " +
    "measure.", ["Laboratory", "Your own design"]],
  ["Let a hidden effect be found", "Measured data of trefoil bodies with an effect that their model lacks: start the " +
    "diagnosis, and see it named.", ["Diagnose"]],
];
const keys = element("ul", { class: "keys" });
const beginning = element("dialog", { id: "beginning", "aria-labelledby": "beginning-title" },
  element("form", { method: "dialog" }, element("h2", { id: "beginning-title" }, "Where do you want to begin?"),
    element("div", { class: "cards" }, ...WAYS.map(([title, text, ...places]) => element("button",
      { class: "card", value: title, onclick: () => requestAnimationFrame(() => {
        for (const [room, section] of places) {
          openRoom(room);
          if (section) openSection(section);
        }
      }) },
      element("b", {}, title), element("span", {}, text)))),
    element("details", {}, element("summary", {}, "Keys"), keys),
    element("button", { class: "close", value: "close" }, "Close")));
document.body.append(beginning);
beginning.addEventListener("close", () => localStorage.setItem("explorer-begun", "yes"));
document.addEventListener("keydown", event => {
  const typing = /^(INPUT|TEXTAREA|SELECT)$/.test(event.target.tagName);
  if (event.key === "?" && !typing && !beginning.open) beginning.showModal();
});
function showKeys(all) {
  keys.replaceChildren(...all.map(([key, label]) => element("li", {}, element("kbd", {}, key), " ", label)));
}

const act = (label, title, command, kind = "") =>
  element("button", { title, "aria-label": title, class: kind, onclick: () => send({ do: command }) }, label);
const toggle = act("▶ Play", "Play or pause (space)", "toggle", "main");
const seek = element("input", { type: "range", min: "0", max: "1", step: "any", value: "0", "aria-label": "Time",
  title: "Back to any moment that is kept. From there the pour goes on anew: what came later is forgotten." });
const events = element("div", { "aria-hidden": "true" });
const clock = element("output", { class: "time" });
const speed = element("select", { "aria-label": "Speed", title: "Simulated seconds per second aimed at", class: "seldom",
  onchange: () => send({ do: "speed", factor: Number(speed.value) }) });
const condition = element("span", { class: "chip", role: "status" });
const recording = element("span", { class: "recording", role: "status" });
const lastEvent = element("span", { class: "event-text", role: "status" });
let seeking = false;
seek.addEventListener("pointerdown", () => { seeking = true; });
seek.addEventListener("pointerup", () => { seeking = false; });
seek.addEventListener("change", () => { seeking = false; send({ do: "seek", time: Number(seek.value) }); });
document.body.append(element("footer", { id: "timeline", "aria-label": "Timeline" },
  act("↻", "Pour again with the same seed (R)", "restart"), act("◀", "Back by one sample interval (←)", "back"), toggle,
  act("▶|", "On by one sample interval (→)", "step"), clock, element("div", { class: "track" }, events, seek),
  condition, speed, recording, lastEvent));

function showTimeline(now) {
  toggle.textContent = now.playing ? "❚❚ Pause" : "▶ Play";
  clock.textContent = `${now.time.toFixed(3)} s`;
  seek.min = now.earliest; seek.max = Math.max(now.end, now.earliest + 1e-3);
  seek.setAttribute("aria-valuetext", clock.textContent);
  if (!seeking) seek.value = now.time;
  const span = seek.max - seek.min;
  events.replaceChildren(...now.events.filter(one => one.time >= now.earliest).map(one => {
    const mark = element("span", { class: "event", title: `${one.time.toFixed(3)} s  ${one.text}` });
    mark.style.left = `${100 * (one.time - now.earliest) / span}%`;
    return mark;
  }));
  lastEvent.textContent = now.notice || now.busy || (now.events.length ? now.events[now.events.length - 1].text : "");
  lastEvent.classList.toggle("notice", Boolean(now.notice));
  lastEvent.title = lastEvent.textContent;
  if (speed.dataset.choices !== String(now.speeds)) {
    speed.dataset.choices = String(now.speeds);
    speed.replaceChildren(...now.speeds.map(one => element("option", { value: one }, `× ${one}`)));
  }
  if (document.activeElement !== speed) speed.value = now.speed;
  condition.textContent = now.condition;
  condition.classList.toggle("trouble", now.trouble);
  recording.textContent = now.recording ? `● ${now.recording}` : "";
}

// A link may hold a pour behind its #. It is offered in words here; nothing is sent before somebody presses the button.
// The page's head has taken it out of the address, which viser makes that of its socket from.
const offer = element("div", { id: "offer", role: "status", hidden: "" });
document.body.append(offer);
function offerPour(text) {
  const fields = new URLSearchParams(text);
  if (!fields.has("pour")) return;
  const named = [fields.get("pour"), fields.get("material") || "", ...fields.getAll("set"),
    `seed ${fields.get("seed") || 0}`, `up to ${Number(fields.get("time") || 0).toFixed(3)} s`];
  const done = () => { offer.hidden = true; };
  offer.replaceChildren(element("span", {}, "This link holds another pour: ", element("b", {}, named.filter(Boolean).join(", "))),
    element("button", { class: "main", onclick: () => { if (send({ do: "pour_link", text })) done(); } }, "Pour it"),
    element("button", { onclick: done }, "Leave it"));
  offer.hidden = false;
}
offerPour(window.linked.slice(1));
window.addEventListener("hashchange", () => {
  offerPour(location.hash.slice(1));
  history.replaceState(null, "", location.pathname + location.search);
});

const show = {
  project: showSteps,
  timeline: showTimeline,
  keys: showKeys,
  theme: theme => document.documentElement.classList.toggle("light", !theme.dark),
};

function connect() {
  channel = new WebSocket(`${location.protocol === "https:" ? "wss" : "ws"}://${location.host}/shell/channel`);
  channel.onmessage = message => {
    for (const [key, value] of Object.entries(JSON.parse(message.data))) show[key]?.(value);
  };
  channel.onopen = () => {
    unsent?.forEach(text => channel.send(text));
    unsent = null;
  };
  channel.onclose = () => setTimeout(connect, RECONNECT_MS);
}
connect();
if (!localStorage.getItem("explorer-begun")) beginning.showModal();

// The rooms that are open when a page is left are opened when it is loaded again, in this window. They come late on a
// busy machine: not after a room that was opened in the meantime.
const ROOMS = "explorer-rooms", PATIENT = 240;  // tries: a minute, for a page on a busy machine
window.addEventListener("pagehide", () => {
  sessionStorage.setItem(ROOMS, JSON.stringify(tabs().filter(isOpen).map(one => one.textContent.trim())));
});
for (const room of JSON.parse(sessionStorage.getItem(ROOMS) || "[]")) {
  soon(() => tabOf(room), tab => {
    if (!restoring || isOpen(tab)) return;
    press(tab);
    tab.blur();
  }, PATIENT);
}

// For the boards in the study panel, which are pages of this server and of the same origin.
window.explorer = { send, openRoom };
