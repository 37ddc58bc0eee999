// Five hints at the first visit, each beside what it explains.
import { byId, make } from "./dom.js";

const SEEN = "hvcpd-hints-seen";
const TOP = "main";
const HINTS = {
  live: [
    [TOP, "This page shows what one robot hears. The stop button halts it at once, without asking."],
    ["#talk", "Every sentence appears here, with its listener’s confidence. A dashed edge means: not sure."],
    ["#robots", "The robots that are here, and what each is doing."],
    ["#map", "Where the robot is, and where the tasks are. A pale mark is a task that is not done yet."],
    ["#board", "All tasks. “Again” repeats one, “Skip” leaves it out this time."],
  ],
  replay: [
    [TOP, "This is a recorded mission. Press Play at the bottom; the sound is the clock."],
    ["#talk", "Every sentence appears when it was said. Below it you see who understood it, and with what confidence."],
    ["#map", "The robots move as they did then. A mark is pale until its task is done."],
    ["#board", "Who has claimed each task, and what is done so far."],
    [TOP, "Choose a speed, or move the slider to any time: everything follows."],
  ],
};

function remembered() {
  try {
    return localStorage.getItem(SEEN) !== null;
  } catch {
    return false; // a browser that keeps nothing shows the hints each time
  }
}

function remember() {
  try {
    localStorage.setItem(SEEN, "yes");
  } catch { /* as above */ }
}

function headOf(section) {
  const heading = section.querySelector("h2");
  return heading.closest(".talk-head") ?? heading;
}

/** Offers the hints, and shows them by itself the first time; `mode` is "live" or "replay". */
export function offerHints(mode) {
  const hints = HINTS[mode];
  const again = byId("hints");
  let card = null;

  function end() {
    remember();
    if (card?.contains(document.activeElement)) again.focus();
    card?.remove();
    card = null;
    again.setAttribute("aria-expanded", "false");
  }

  function show(number, withFocus) {
    const [selector, text] = hints[number];
    const place = document.querySelector(selector);
    const last = number === hints.length - 1;
    const next = make("button", { type: "button", class: "quiet" }, last ? "Done" : "Next");
    const skip = last ? null : make("button", { type: "button", class: "quiet" }, "No more hints");
    const head = make("b", {}, `Hint ${number + 1} of ${hints.length}`);
    card?.remove();
    card = make("aside", { class: "hint", "aria-label": "Hints" }, head, make("p", {}, text), next, skip);
    next.addEventListener("click", () => (last ? end() : show(number + 1, true)));
    skip?.addEventListener("click", end);
    card.addEventListener("keydown", (event) => {
      if (event.key === "Escape") end();
    });
    if (selector === TOP) place.prepend(card);
    else headOf(place.closest("section")).after(card);
    again.setAttribute("aria-expanded", "true");
    if (withFocus) next.focus();
  }

  again.addEventListener("click", () => (card ? end() : show(0, true)));
  if (!remembered()) show(0, false);
}
