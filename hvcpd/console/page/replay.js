// A recorded mission: the sound is the clock, and what had happened until then is shown.
import { byId, missionClock, setText } from "./dom.js";
import { asText } from "./talk.js";

const PAGE = 150;
const sound = byId("sound");
const caption = byId("caption");

/** A clock that runs without sound, with the part of an audio element's interface that is used here. */
class Silence extends EventTarget {
  constructor(duration) {
    super();
    this.duration = duration;
    this.currentTime = 0;
    this.paused = true;
    this.playbackRate = 1;
  }

  async play() {
    if (!this.paused) return;
    this.set(false);
    if (this.currentTime >= this.duration) this.currentTime = 0;
    let last = performance.now();
    const step = (now) => {
      if (this.paused) return;
      this.currentTime = Math.min(this.currentTime + (this.playbackRate * (now - last)) / 1000, this.duration);
      last = now;
      if (this.currentTime < this.duration) requestAnimationFrame(step);
      else this.pause();
    };
    requestAnimationFrame(step);
  }

  pause() {
    this.set(true);
  }

  set(paused) {
    this.paused = paused;
    this.dispatchEvent(new Event(paused ? "pause" : "play"));
  }
}

/** The big button and the speeds, for a clock of either kind. */
function offerControls(clock) {
  const play = byId("play");
  const speed = byId("speed");
  const tell = () => {
    setText(play, clock.paused ? "▶ Play" : "❚❚ Pause");
    play.setAttribute("aria-pressed", String(!clock.paused));
  };
  play.addEventListener("click", () => {
    if (clock.paused) clock.play().catch(tell);
    else clock.pause();
  });
  speed.addEventListener("change", () => {
    clock.playbackRate = Number(speed.value);
  });
  for (const event of ["play", "pause", "ended"]) clock.addEventListener(event, tell);
}

/** `makeTalk(source)` makes the conversation, `take(talk, message)` shows a message. */
export async function replay(makeTalk, take) {
  const recording = await fetch("replay").then((reply) => reply.json());
  const { steps } = recording;
  const lines = steps.filter((step) => step.message.kind === "line").map((step) => step.message.line);
  let shown = 0; // number of steps shown
  let seen = 0; // number of lines among them
  const source = {
    before: async (n) => ({ lines: lines.slice(Math.max((n ?? seen) - PAGE, 0), n ?? seen), first: 0 }),
    after: async (n) => ({ lines: lines.slice(n + 1, Math.min(n + 1 + PAGE, seen)), first: 0 }),
  };
  const talk = makeTalk(source);
  const link = { kind: "link", up: true, text: `Recorded mission, ${missionClock.time(recording.duration_s)} minutes` };

  function beginAnew() {
    shown = 0;
    seen = 0;
    take(talk, { ...recording.begin, lines: [], first: 0 });
    take(talk, link);
  }

  function skipTo(now) {
    if (shown > 0 && steps[shown - 1].at_s > now) beginAnew();
    const due = [];
    while (shown < steps.length && steps[shown].at_s <= now) {
      due.push(steps[shown].message);
      shown += 1;
    }
    const spoken = due.filter((message) => message.kind === "line").map((message) => message.line);
    seen += spoken.length;
    if (spoken.length > PAGE / 4) {
      talk.reset(lines.slice(Math.max(seen - PAGE, 0), seen), 0); // one has jumped: nobody wants to be told all that
      due.filter((message) => message.kind !== "line").forEach((message) => take(talk, message));
    } else due.forEach((message) => take(talk, message));
    const last = lines[seen - 1];
    setText(caption, last && now < last.at_s + 8 ? asText(last) : "");
  }

  beginAnew();
  byId("player").hidden = false;
  let clock = sound;
  if (recording.has_sound) sound.src = "sound";
  else {
    sound.hidden = true;
    clock = new Silence(recording.duration_s);
  }
  offerControls(clock);
  const frame = () => {
    skipTo(clock.currentTime);
    requestAnimationFrame(frame);
  };
  frame();
}
