// The room from above: the plan comes drawn, robots and their trails are put into it.
import { byId, drawing, makeSvg, setText } from "./dom.js";

const holder = byId("map");
const places = byId("places");
const STEP_M = 0.05; // between two points of a trail, as the console keeps them
const MOST_POINTS = 4000;

export class Plan {
  constructor() {
    this.robots = new Map();
    this.done = new Set();
  }

  /** `message`: the plan as SVG text, made by the console itself, and trails so far. */
  show(message) {
    const drawn = message.svg ? drawing(message.svg) : null;
    this.robots.clear();
    holder.replaceChildren();
    this.svg = drawn;
    if (!drawn) return;
    holder.append(drawn);
    const { left, bottom, high, scale, pad } = drawn.dataset;
    this.frame = [left, bottom, high, scale, pad].map(Number);
    for (const trail of message.trails) {
      const robot = this.robot(trail.name, trail.slot);
      robot.points = trail.points.map(([x, y]) => [x, y]);
      this.draw(robot);
      if (trail.x_m !== undefined) this.put(robot, trail.x_m, trail.y_m, trail.heading_deg);
    }
    this.mark(this.done);
  }

  /** Where a robot is now. */
  move(message) {
    if (!this.svg) return;
    const robot = this.robot(message.name, message.slot);
    const last = robot.points.at(-1);
    const far = !last || Math.hypot(last[0] - message.x_m, last[1] - message.y_m) >= STEP_M;
    if (far) {
      robot.points.push([message.x_m, message.y_m]);
      if (robot.points.length > MOST_POINTS) robot.points.splice(0, MOST_POINTS / 4);
      this.draw(robot);
    }
    this.put(robot, message.x_m, message.y_m, message.heading_deg);
    if (far) this.tell();
  }

  /** Which tasks are done: their marks are no longer pale. */
  mark(done) {
    this.done = done;
    for (const mark of holder.querySelectorAll("[data-task]")) {
      mark.classList.toggle("undone", !done.has(Number(mark.dataset.task)));
    }
  }

  at(x, y) {
    const [left, bottom, high, scale, pad] = this.frame;
    return [pad + (x - left) * scale, pad + (high - (y - bottom)) * scale];
  }

  robot(name, slot) {
    if (!this.robots.has(name)) {
      const trail = makeSvg("polyline", { class: `trail r${slot}` });
      const group = makeSvg("g", { class: `puck-group r${slot}` });
      const nose = makeSvg("path", { class: "heading", d: "M7 0-3-4-3 4Z" });
      const label = makeSvg("text", { class: `label r${slot}`, "text-anchor": "middle", y: 28 });
      label.textContent = name;
      const body = makeSvg("g");
      body.append(makeSvg("circle", { class: "puck", r: 11 }), nose);
      group.append(body, label);
      this.svg.append(trail, group);
      this.robots.set(name, { name, trail, group, body, nose, points: [] });
    }
    return this.robots.get(name);
  }

  draw(robot) {
    robot.trail.setAttribute("points", robot.points.map(([x, y]) => this.at(x, y).map((u) => u.toFixed(1)).join()).join(" "));
  }

  put(robot, x, y, heading) {
    const [u, v] = this.at(x, y);
    robot.group.setAttribute("transform", `translate(${u.toFixed(1)} ${v.toFixed(1)})`);
    robot.nose.style.display = heading === undefined ? "none" : "";
    if (heading !== undefined) robot.body.setAttribute("transform", `rotate(${-heading})`);
    robot.where = `${robot.name} is at ${x.toFixed(1)} m, ${y.toFixed(1)} m`;
  }

  /** In words, for who does not see the map. */
  tell() {
    setText(places, [...this.robots.values()].map((robot) => robot.where).filter(Boolean).join("; "));
  }
}
