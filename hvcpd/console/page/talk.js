// The conversation: a window of lines that grows at both ends as one scrolls, however long the whole is.
import { byId, make } from "./dom.js";

const MOST = 600; // lines in the page at a time
const NEAR_PX = 600; // distance from an end at which more is fetched
const AT_END_PX = 40;
const LATE = 20; // a sentence comes when it was understood, with the time when it began: most lines that may be newer

const inTime = (lines) => [...lines].sort((one, other) => one.at_s - other.at_s || one.n - other.n);

const isSpoken = (line) => Boolean(line.who) && (line.sort === "said" || line.sort === "heard");

/** A line as one text: "Rob: task one complete", "Rob has carried out task one". */
export function asText(line) {
  return line.who ? `${line.who}${isSpoken(line) ? ":" : ""} ${line.text}` : line.text;
}

export class Talk {
  /** `source`: `{before(n), after(n)}`, each a promise of `{lines, first}`; `clock`: how times are told. */
  constructor(source, clock) {
    this.source = source;
    this.clock = clock;
    this.list = byId("chat");
    this.news = byId("news");
    this.latest = byId("latest");
    this.lines = [];
    this.first = 0;
    this.missed = 0;
    this.busy = false;
    this.atEnd = true; // the newest line is in the page
    this.list.addEventListener("scroll", () => this.scrolled(), { passive: true });
    this.latest.addEventListener("click", () => this.toLatest());
  }

  /** Show these lines, the newest there are. */
  reset(lines, first) {
    this.lines = inTime(lines);
    this.first = first;
    this.atEnd = true;
    this.list.replaceChildren(...this.lines.map((line, k) => this.item(line, this.lines[k - 1])));
    this.stick();
  }

  /** One more line, just now. */
  add(line) {
    this.say(line);
    if (!this.atEnd || !this.isAtBottom()) this.missed += 1;
    if (this.atEnd) {
      const sticks = this.isAtBottom();
      this.insert(line);
      if (sticks) {
        this.drop(this.lines.length - MOST, true);
        this.stick();
      } else if (this.lines.length > 2 * MOST) {
        this.drop(this.lines.length - MOST, false);
        this.atEnd = false;
      }
    }
    this.showMissed();
  }

  /** Put a line where it belongs in time. */
  insert(line) {
    let at = this.lines.length;
    while (at > 0 && this.lines.length - at < LATE && this.lines[at - 1].at_s > line.at_s) at -= 1;
    this.list.insertBefore(this.item(line, this.lines[at - 1]), this.list.children[at] ?? null);
    this.lines.splice(at, 0, line);
  }

  oldest() {
    return Math.min(...this.lines.map((line) => line.n));
  }

  /** For a screen reader, which does not read a list that changes at both ends. */
  say(line) {
    const doubt = line.marks.find((mark) => mark.kind !== "good");
    this.news.append(make("p", {}, `${asText(line)}${doubt ? ` (${doubt.text})` : ""}`));
    while (this.news.children.length > 3) this.news.firstChild.remove();
  }

  item(line, before) {
    const time = make("time", {}, this.clock.time(line.at_s));
    const day = this.clock.day(line.at_s);
    const item = isSpoken(line) ? this.bubble(line, time) : this.note(line, time);
    item.dataset.n = line.n;
    if (day && (!before || this.clock.day(before.at_s) !== day)) item.dataset.day = day;
    return item;
  }

  bubble(line, time) {
    const marks = line.marks.map((mark) => make("li", { class: mark.kind }, mark.text));
    const doubtful = line.marks.some((mark) => mark.kind === "unsure");
    const head = make("div", { class: "who" }, make("b", {}, line.who), time);
    const list = marks.length ? make("ul", { class: "marks" }, ...marks) : null;
    const bubble = make("div", { class: "bubble" }, head, make("p", {}, line.text), list);
    const side = line.slot % 2 ? " right" : "";
    return make("li", { class: `said ${line.sort} r${line.slot}${side}${doubtful ? " doubtful" : ""}` }, bubble);
  }

  note(line, time) {
    const who = line.who ? make("b", {}, line.who) : null;
    return make("li", { class: "act" }, time, who, make("span", { class: line.sort }, line.text));
  }

  isAtBottom() {
    return this.list.scrollHeight - this.list.scrollTop - this.list.clientHeight < AT_END_PX;
  }

  stick() {
    this.list.scrollTop = this.list.scrollHeight;
    this.missed = 0;
    this.showMissed();
  }

  showMissed() {
    this.latest.hidden = this.atEnd && this.missed === 0;
    this.latest.textContent = this.missed ? `To the newest (${this.missed})` : "To the newest";
  }

  async toLatest() {
    if (!this.atEnd) {
      const page = await this.source.before(null);
      this.reset(page.lines, page.first);
    }
    this.stick();
    this.list.focus();
  }

  /** Let go of lines at one end. */
  drop(count, atStart) {
    for (let k = 0; k < count; k += 1) {
      if (atStart) this.list.firstChild.remove();
      else this.list.lastChild.remove();
    }
    if (count > 0) this.lines = atStart ? this.lines.slice(count) : this.lines.slice(0, -count);
  }

  scrolled() {
    if (this.atEnd && this.isAtBottom()) {
      this.missed = 0;
      this.showMissed();
    }
    if (this.busy || !this.lines.length) return;
    if (this.list.scrollTop < NEAR_PX && this.oldest() > this.first) this.fetchBefore();
    else if (!this.atEnd && this.list.scrollHeight - this.list.scrollTop - this.list.clientHeight < NEAR_PX) this.fetchAfter();
  }

  async fetchBefore() {
    await this.fetching(async () => {
      const page = await this.source.before(this.oldest());
      page.lines = inTime(page.lines);
      this.first = page.first;
      const height = this.list.scrollHeight;
      const top = this.list.scrollTop;
      this.list.prepend(...page.lines.map((line, k) => this.item(line, page.lines[k - 1])));
      this.lines = [...page.lines, ...this.lines];
      this.list.scrollTop = top + this.list.scrollHeight - height;
      if (this.lines.length > MOST) {
        this.drop(this.lines.length - MOST, false);
        this.atEnd = false;
      }
      this.showMissed();
    });
  }

  async fetchAfter() {
    await this.fetching(async () => {
      const page = await this.source.after(Math.max(...this.lines.map((line) => line.n)));
      page.lines = inTime(page.lines);
      const before = this.lines.at(-1);
      this.list.append(...page.lines.map((line, k) => this.item(line, page.lines[k - 1] ?? before)));
      this.lines.push(...page.lines);
      this.atEnd = page.lines.length === 0;
      const excess = this.lines.length - MOST;
      if (excess > 0) {
        const height = this.list.scrollHeight;
        const top = this.list.scrollTop;
        this.drop(excess, true);
        this.list.scrollTop = top - (height - this.list.scrollHeight);
      }
      this.showMissed();
    });
  }

  async fetching(work) {
    this.busy = true;
    try {
      await work();
    } catch {
      // the console is gone for the moment; the next scroll tries again
    } finally {
      this.busy = false;
    }
  }
}
