// The stop button, which asks nothing, and resuming, which asks twice.
import { byId, setText } from "./dom.js";

const stop = byId("stop");
const resume = byId("resume");
const told = byId("told");
const ask = byId("ask");
const DOING = {
  stop: "Stopping …",
  resume: "Resuming …",
  again: "Asking for the task again …",
  skip: "Leaving the task out …",
  add: "Comparing the task's words with all others …",
  remove: "Removing the task …",
};
let stops = 0;
const token = document.querySelector("meta[name=hvcpd-token]").content;

export async function act(wanted) {
  if (wanted.do === "stop") stops += 1;
  const before = stops; // the reply to what was wanted before a stop must not hide the stop's
  const tell = (text) => before === stops && setText(told, text);
  told.hidden = false;
  tell(DOING[wanted.do]);
  try {
    const reply = await fetch("act", {
      method: "POST",
      headers: { "content-type": "application/json", "x-hvcpd-token": token },
      body: JSON.stringify(wanted),
    });
    const answer = await reply.json();
    tell(answer.told ?? answer.error ?? "The console gave no answer.");
  } catch {
    tell("The console does not answer. Stop the robots by voice: “stop”!");
  }
}

export function begin() {
  byId("controls").hidden = false;
  stop.addEventListener("click", () => act({ do: "stop", all: true }));
  resume.addEventListener("click", () => {
    ask.returnValue = "no";
    ask.showModal();
  });
  ask.addEventListener("close", () => {
    if (ask.returnValue !== "no" && ask.returnValue !== "") act({ do: "resume", all: ask.returnValue === "all", confirmed: true });
  });
}

export function showStopped(message) {
  const name = message.robots[0]?.name ?? "";
  resume.hidden = !message.stopped;
  setText(stop, message.stopped ? "Stop again" : "Stop");
  stop.setAttribute("aria-label", name ? `Stop ${name}, and all others by voice` : "Stop");
  setText(byId("ask-one"), name ? `Resume ${name}` : "Resume");
}
