// What the page is made of, live or replayed: messages come in, and each part shows its own.
import { beginAdding, showAlarms, showBoard, showLevel, showRobots } from "./board.js";
import { begin, showStopped } from "./controls.js";
import { byId, missionClock, setText, wallClock } from "./dom.js";
import { Plan } from "./map.js";
import { replay } from "./replay.js";
import { Talk } from "./talk.js";
import { offerHints } from "./tour.js";

const live = document.body.dataset.mode === "live";
const link = byId("link");
const plan = new Plan();

function showLink(message) {
  setText(link, message.text);
  link.className = `pill ${message.up ? "up" : "down"}`;
}

function page(query) {
  return fetch(`lines${query}`).then((reply) => reply.json());
}

const source = {
  before: (n) => page(n === null ? "" : `?before=${n}`),
  after: (n) => page(`?after=${n}`),
};

function take(talk, message) {
  switch (message.kind) {
    case "snapshot":
      message.parts.forEach((part) => take(talk, part));
      if (message.plan) plan.show(message.plan);
      talk.reset(message.lines, message.first);
      break;
    case "robots":
      showRobots(message);
      if (live) showStopped(message);
      break;
    case "board":
      showBoard(message);
      plan.mark(new Set(message.tasks.filter((task) => task.state === "done").map((task) => task.number)));
      break;
    case "alarms": showAlarms(message); break;
    case "level": showLevel(message); break;
    case "link": showLink(message); break;
    case "plan": plan.show(message); break;
    case "moved": plan.move(message); break;
    case "line": talk.add(message.line); break;
    default: break; // of a newer console
  }
}

function follow(talk) {
  begin();
  beginAdding();
  const events = new EventSource("events");
  events.addEventListener("message", (event) => take(talk, JSON.parse(event.data)));
  events.addEventListener("error", () => {
    showLink({ up: false, text: "The console does not answer; trying again …" });
    if (events.readyState === EventSource.CLOSED) setTimeout(() => location.reload(), 3000);
  });
}

offerHints(live ? "live" : "replay");
if (live) follow(new Talk(source, wallClock));
else replay((lines) => new Talk(lines, missionClock), take);
