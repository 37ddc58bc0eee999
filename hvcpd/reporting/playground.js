"use strict";
(() => {
  const data = JSON.parse(document.getElementById("data").textContent);
  const RATE = data.rate;
  const FIRST = ["hi", "hello", "all", ...data.robots.map((robot) => robot.name.toLowerCase())];
  const NUMBERS = "zero one two three four five six seven eight nine ten eleven twelve".split(" ");
  const wordNumber = new Map(data.words.map((word, k) => [word, k]));
  const finals = new Set(data.graph.finals), pauses = new Set(data.graph.pauses);
  const arcs = new Map();
  for (const [source, target, word] of data.graph.arcs) {
    if (!arcs.has(source)) arcs.set(source, new Map());
    arcs.get(source).set(data.words[word], target);
  }
  const names = new Map(data.robots.map((robot) => [robot.name.toLowerCase(), robot.name]));
  const input = document.getElementById("sentence");
  const verdict = document.getElementById("verdict");
  const next = document.getElementById("next");
  const panels = [...document.querySelectorAll(".robot")];

  // The words of a text, and the node of the word network after each; `wrong` is the first word that has no arc.
  function parse(text) {
    const words = (text.toLowerCase().match(/[a-z]+|\d+/g) || []).map((word) => NUMBERS[Number(word)] || word);
    const nodes = [data.graph.start];
    for (const word of words) {
      const from = arcs.get(nodes[nodes.length - 1]);
      const to = from ? from.get(word) : undefined;
      if (to === undefined) return { words, nodes, wrong: word, whole: false };
      nodes.push(to);
    }
    const end = nodes[nodes.length - 1];
    return { words, nodes, wrong: null, whole: words.length > 0 && finals.has(end) };
  }

  function follow(node) {
    const found = [...(arcs.get(node) || new Map()).keys()];
    const rank = (word) => (FIRST.includes(word) ? FIRST.indexOf(word) : FIRST.length);
    return found.sort((a, b) => rank(a) - rank(b) || NUMBERS.indexOf(a) - NUMBERS.indexOf(b) || a.localeCompare(b));
  }

  const shown = (word) => names.get(word) || (word === "i" ? "I" : word);

  // Joins a robot's words as the synthesizer does: overlapping within a phrase, with a pause after a phrase's last word.
  function join(robot, sound, sentence) {
    const pieces = [];
    let cursor = 0, afterPause = true;
    sentence.words.forEach((word, k) => {
      const isLast = k === sentence.words.length - 1 || pauses.has(sentence.nodes[k + 1]);
      const [begin, length, lead, advance] = robot.units[2 * wordNumber.get(word) + (isLast ? 1 : 0)];
      if (afterPause) cursor = Math.max(cursor - lead, 0);
      afterPause = isLast;
      pieces.push({ word, at: cursor, begin, length });
      cursor += advance;
    });
    const samples = new Float32Array(Math.max(...pieces.map((piece) => piece.at + piece.length)));
    for (const { at, begin, length } of pieces) for (let k = 0; k < length; k += 1) samples[at + k] += sound[begin + k];
    return { samples, pieces };
  }

  const decoded = new Map();
  function soundOf(robot) { // decoded at its own rate, so that every word begins at its sample
    if (!decoded.has(robot)) {
      const bytes = Uint8Array.from(atob(robot.flac), (c) => c.charCodeAt(0));
      const decoder = new OfflineAudioContext(1, 1, RATE);
      decoded.set(robot, decoder.decodeAudioData(bytes.buffer).then((buffer) => buffer.getChannelData(0)));
    }
    return decoded.get(robot);
  }

  // In-place radix-2 transform (Cooley and Tukey 1965) of real and imaginary parts; the length is a power of two.
  function transform(re, im) {
    const n = re.length;
    for (let i = 1, j = 0; i < n; i += 1) {
      let bit = n >> 1;
      for (; j & bit; bit >>= 1) j ^= bit;
      j ^= bit;
      if (i < j) { [re[i], re[j]] = [re[j], re[i]]; [im[i], im[j]] = [im[j], im[i]]; }
    }
    for (let size = 2; size <= n; size *= 2) {
      const angle = -2 * Math.PI / size;
      for (let from = 0; from < n; from += size) {
        for (let k = 0; k < size / 2; k += 1) {
          const c = Math.cos(angle * k), s = Math.sin(angle * k), a = from + k, b = a + size / 2;
          const x = re[b] * c - im[b] * s, y = re[b] * s + im[b] * c;
          re[b] = re[a] - x; im[b] = im[a] - y; re[a] += x; im[a] += y;
        }
      }
    }
  }

  const FFT = 512, WINDOW = 400, RANGE_DB = 55;
  const hann = Float64Array.from({ length: WINDOW }, (_, k) => 0.5 - 0.5 * Math.cos(2 * Math.PI * k / (WINDOW - 1)));
  function draw(canvas, samples) {
    const { width, height } = canvas, context = canvas.getContext("2d");
    const levels = [], hop = Math.max((samples.length - WINDOW) / width, 1);
    let loudest = 1e-12;
    for (let x = 0; x < width; x += 1) {
      const re = new Float64Array(FFT), im = new Float64Array(FFT), from = Math.round(x * hop);
      for (let k = 0; k < WINDOW; k += 1) { // pre-emphasis, as phonetics programs show speech
        re[k] = ((samples[from + k] || 0) - 0.97 * (samples[from + k - 1] || 0)) * hann[k];
      }
      transform(re, im);
      const column = Float64Array.from({ length: FFT / 2 }, (_, k) => re[k] * re[k] + im[k] * im[k]);
      for (const power of column) loudest = Math.max(loudest, power);
      levels.push(column);
    }
    const image = context.createImageData(width, height);
    const dark = matchMedia("(prefers-color-scheme: dark)").matches;
    for (let x = 0; x < width; x += 1) {
      for (let y = 0; y < height; y += 1) {
        const power = levels[x][Math.floor((1 - (y + 0.5) / height) * FFT / 2)];
        const share = Math.min(Math.max(1 + 10 * Math.log10(power / loudest + 1e-12) / RANGE_DB, 0), 1);
        const grey = dark ? 20 + 225 * share : 251 - 231 * share;
        image.data.set([grey, grey, grey, 255], 4 * (y * width + x));
      }
    }
    context.putImageData(image, 0, 0);
  }

  function label(panel, said) {
    const words = panel.querySelector(".words"), total = said.samples.length;
    words.replaceChildren(...said.pieces.map((piece, k) => {
      const span = document.createElement("span"), until = k + 1 < said.pieces.length ? said.pieces[k + 1].at : total;
      span.textContent = shown(piece.word);
      span.style.left = `${100 * piece.at / total}%`;
      span.style.width = `${100 * (until - piece.at) / total}%`;
      return span;
    }));
  }

  let context = null, playing = null, turn = 0;
  function stop() {
    turn += 1;
    if (playing) { playing.onended = null; playing.stop(); playing = null; }
    document.querySelectorAll(".playing, .now").forEach((element) => element.classList.remove("playing", "now"));
  }

  async function say(k, sentence) {
    const robot = data.robots[k], panel = panels[k], own = turn;
    const said = join(robot, await soundOf(robot), sentence);
    if (own !== turn) return false;
    draw(panel.querySelector("canvas"), said.samples);
    label(panel, said);
    context = context || new AudioContext();
    await context.resume();
    if (own !== turn) return false;
    const buffer = context.createBuffer(1, said.samples.length, RATE);
    buffer.copyToChannel(said.samples, 0);
    playing = context.createBufferSource();
    playing.buffer = buffer;
    playing.connect(context.destination);
    panel.classList.add("playing");
    const began = context.currentTime, spans = [...panel.querySelectorAll(".words span")];
    const cursor = panel.querySelector(".cursor"), length = said.samples.length / RATE;
    const step = () => {
      if (own !== turn || !panel.classList.contains("playing")) return;
      const now = Math.min(context.currentTime - began, length);
      cursor.style.left = `${100 * now / length}%`;
      spans.forEach((span, j) => {
        const from = said.pieces[j].at / RATE, to = j + 1 < spans.length ? said.pieces[j + 1].at / RATE : length;
        span.classList.toggle("now", now >= from && now < to);
      });
      requestAnimationFrame(step);
    };
    await new Promise((resolve) => { playing.onended = resolve; playing.start(); step(); });
    panel.classList.remove("playing");
    return own === turn;
  }

  function refresh() {
    const sentence = parse(input.value);
    const node = sentence.nodes[sentence.nodes.length - 1];
    verdict.className = sentence.wrong ? "bad" : sentence.whole ? "good" : "";
    verdict.textContent = sentence.wrong ? `“${sentence.wrong}” cannot come here. Choose a word below, or start again.`
      : sentence.whole ? "Robots understand this. Press Enter, or play it below." : "Go on: choose a word, or type one.";
    next.replaceChildren(...follow(node).map((word) => {
      const button = document.createElement("button");
      button.type = "button";
      button.textContent = shown(word);
      button.addEventListener("click", () => {
        input.value = [...sentence.words.slice(0, sentence.nodes.length - 1), word].map(shown).join(" ");
        refresh();
        if (!next.contains(document.activeElement)) (next.querySelector("button") || input).focus();
      });
      return button;
    }));
    document.querySelectorAll(".say").forEach((button) => { button.disabled = !sentence.whole; });
    return sentence;
  }

  input.addEventListener("input", refresh);
  document.getElementById("form").addEventListener("submit", async (event) => {
    event.preventDefault();
    const sentence = refresh();
    if (!sentence.whole) return;
    stop();
    for (let k = 0; k < panels.length; k += 1) if (!await say(k, sentence)) return;
  });
  document.querySelectorAll(".say").forEach((button) => button.addEventListener("click", () => {
    stop();
    say(Number(button.dataset.robot), parse(input.value));
  }));
  document.querySelectorAll(".scene").forEach((button) => button.addEventListener("click", async () => {
    stop();
    const { lines } = data.scenes[Number(button.dataset.scene)];
    const items = button.parentElement.querySelectorAll("li");
    for (let k = 0; k < lines.length; k += 1) {
      items[k].classList.add("now");
      if (!await say(lines[k].robot, parse(lines[k].text))) return;
      items[k].classList.remove("now");
    }
  }));
  document.addEventListener("keydown", (event) => { if (event.key === "Escape") stop(); });

  input.value = data.scenes[0].lines[0].text;
  const first = refresh();
  data.robots.forEach((robot, k) => soundOf(robot).then((sound) => {
    const said = join(robot, sound, first);
    draw(panels[k].querySelector("canvas"), said.samples);
    label(panels[k], said);
  }));
})();
