"use strict";
(() => {
  const which = document.getElementById("which");
  if (which) {
    which.addEventListener("change", () => {
      for (const figure of document.querySelectorAll("[data-spectrogram]")) {
        figure.hidden = figure.dataset.spectrogram !== which.value;
      }
    });
  }

  const sound = document.getElementById("sound");
  if (!sound) return;
  const whole = document.getElementById("whole");
  const speed = document.getElementById("speed");
  const places = [...document.querySelectorAll(".place[data-done]")];
  const caption = document.getElementById("caption");
  const room = document.querySelector(".room");
  const chat = document.getElementById("chat");
  const timeline = document.getElementById("timeline");
  const cursor = document.getElementById("cursor");
  const said = [...document.querySelectorAll(".said")].map((item) => ({
    item,
    from: Number(item.dataset.from),
    to: Number(item.dataset.to),
    button: item.querySelector(".play"),
    bar: document.querySelector(`.speech[data-utterance="${CSS.escape(item.dataset.utterance)}"]`),
  }));
  const LEAD_S = 0.05, TAIL_S = 0.15; // room for the sound's way to the listener: 51 m
  const scale = Number(cursor.dataset.scale);

  // A blob can be sought to the sample in every browser; a data address cannot.
  const bytes = Uint8Array.from(atob(sound.src.slice(sound.src.indexOf(",") + 1)), (c) => c.charCodeAt(0));
  sound.src = URL.createObjectURL(new Blob([bytes], { type: "audio/flac" }));

  const pucks = [...document.querySelectorAll(".trail")].map((trail, k) => ({
    puck: document.querySelectorAll("[data-puck]")[k],
    times: trail.dataset.times.split(" ").map(Number),
    points: trail.getAttribute("points").split(" ").map((pair) => pair.split(",").map(Number)),
  }));

  let chosen = null; // the one utterance that is being played, if it is one
  let shown = new Set();

  function place(track, now) {
    const { times, points, puck } = track;
    let low = 0, high = times.length - 1;
    while (low < high) {
      const middle = (low + high) >> 1;
      if (times[middle] < now) low = middle + 1; else high = middle;
    }
    const before = Math.max(low - 1, 0);
    const length = times[low] - times[before];
    const share = length > 0 ? Math.min(Math.max((now - times[before]) / length, 0), 1) : 1;
    puck.setAttribute("cx", points[before][0] + share * (points[low][0] - points[before][0]));
    puck.setAttribute("cy", points[before][1] + share * (points[low][1] - points[before][1]));
  }

  function show() {
    const now = sound.currentTime;
    const playing = !sound.paused;
    document.body.classList.toggle("playing", playing || now > 0);
    cursor.setAttribute("x1", now * scale);
    cursor.setAttribute("x2", now * scale);
    pucks.forEach((track) => place(track, now));
    const isUnderWay = playing || (now > 0 && !sound.ended);
    for (const mark of places) mark.classList.toggle("undone", isUnderWay && now < Number(mark.dataset.done));
    const active = new Set(playing ? said.filter((s) => (chosen ? s === chosen : s.from <= now && now < s.to)) : []);
    for (const s of said) {
      const is = active.has(s);
      s.item.classList.toggle("now", is);
      if (s.bar) s.bar.classList.toggle("now", is);
      s.button.setAttribute("aria-pressed", String(is && s === chosen));
      if (is && !shown.has(s) && !chosen) reveal(s.item);
    }
    shown = active;
    caption.textContent = [...active]
      .map((s) => `${s.item.querySelector("b").textContent}: ${s.item.querySelector("p").textContent}`).join(" + ");
    const all = playing && !chosen;
    whole.setAttribute("aria-pressed", String(all));
    whole.textContent = all ? "❚❚ Pause" : "▶ Play";
    if (all) follow();
  }

  function revealMap() { // whoever presses Play wants to see the robots drive
    const box = room.getBoundingClientRect();
    const end = innerHeight - whole.parentElement.offsetHeight;
    if (box.top < 0 || box.bottom > end) room.scrollIntoView({ block: "start" });
  }

  function reveal(item) { // within the conversation's own box: the page itself stays where its reader has put it
    if (chat.scrollHeight > chat.clientHeight + 1) {
      chat.scrollTop = item.offsetTop - chat.offsetTop - chat.clientHeight / 3;
    }
  }

  function follow() {
    const box = timeline.parentElement;
    const x = sound.currentTime * scale;
    if (x < box.scrollLeft || x > box.scrollLeft + box.clientWidth * 0.85) box.scrollLeft = x - box.clientWidth * 0.15;
  }

  function frame() {
    if (chosen && sound.currentTime >= chosen.to + TAIL_S) sound.pause();
    show();
    if (!sound.paused) requestAnimationFrame(frame);
  }

  function start(at, utterance) {
    chosen = utterance;
    sound.currentTime = Math.max(at, 0);
    sound.play().catch(() => { chosen = null; show(); });
  }

  for (const s of said) {
    s.button.addEventListener("click", () => {
      if (s === chosen && !sound.paused) sound.pause();
      else start(s.from - LEAD_S, s);
    });
  }
  whole.addEventListener("click", () => {
    if (!sound.paused && !chosen) sound.pause();
    else {
      revealMap();
      start(sound.ended || sound.currentTime >= sound.duration ? 0 : chosen ? 0 : sound.currentTime, null);
    }
  });
  timeline.addEventListener("click", (event) => {
    const box = timeline.getBoundingClientRect();
    const units = timeline.viewBox.baseVal;
    const x = ((event.clientX - box.left) / box.width) * units.width - Number(timeline.dataset.pad);
    chosen = null;
    sound.currentTime = Math.min(Math.max(x / scale, 0), sound.duration || 0);
    show();
  });
  speed.addEventListener("change", () => { sound.playbackRate = Number(speed.value); });
  sound.addEventListener("play", () => requestAnimationFrame(frame));
  sound.addEventListener("pause", () => { if (!sound.seeking) show(); });
  sound.addEventListener("seeked", show);
  sound.addEventListener("ended", show);
})();
