// Who is here, the board of tasks, alarms, and the meter.
import { act } from "./controls.js";
import { byId, drawing, make, setText } from "./dom.js";

const robots = byId("robots");
const board = byId("board");
const alarms = byId("alarms");
const meter = byId("meter");
const LOWEST_DBFS = -80;
const LOUD_DBFS = -6; // above this it is clipped now and then

/** Replace an element's children only if something has changed, so that focus and reading stay where they are. */
function renew(element, key, items) {
  const text = JSON.stringify(key);
  if (element.dataset.key === text) return;
  element.dataset.key = text;
  element.replaceChildren(...items());
}

export function showRobots(message) {
  renew(robots, [message.robots, message.speaking], () =>
    message.robots.map((robot, k) => {
      const speaking = k === 0 && message.speaking ? make("span", { class: "speaking" }, "speaking") : null;
      const team = robot.team ? make("span", { class: "soft" }, `team ${robot.team} `) : null;
      const doing = robot.doing ? make("p", {}, robot.doing) : null;
      const note = [robot.present ? "" : "not heard lately", robot.note].filter(Boolean).join(", ");
      const small = note ? make("p", { class: "soft" }, note) : null;
      const kind = `r${robot.slot}${robot.present ? "" : " gone"}`;
      return make("li", { class: kind }, make("b", {}, robot.name), team, speaking, doing, small);
    }),
  );
}

export function showBoard(message) {
  renew(board, message.tasks, () =>
    message.tasks.map((task) => {
      const state = make("span", { class: `state-${task.state}` }, task.state + (task.hearsay ? ", by hearsay" : ""));
      const by = task.owner ? make("span", { class: `by r${task.slot}` }, task.owner) : "–";
      return make(
        "tr",
        {},
        make("td", { "data-head": "No.", class: "no" }, String(task.number)),
        make("th", { scope: "row" }, drawing(task.mark), task.name),
        make("td", { "data-head": "State" }, state),
        make("td", { "data-head": "By" }, by, change(task)),
      );
    }),
  );
}

/** Buttons that have a task done again, or left out, and removed from this robot; none in a recording. */
function change(task) {
  if (document.body.dataset.mode !== "live") return null;
  const wanted = task.state === "done" || task.state === "failed" ? "again" : "skip";
  const first = button(task, wanted, wanted === "again" ? ["Again", "Do again"] : ["Skip", "Skip"]);
  return make("span", {}, first, button(task, "remove", ["Remove", "Remove from this robot"]));
}

function button(task, wanted, [word, label]) {
  const element = make("button", { type: "button", class: "quiet", "aria-label": `${label}: ${task.name}` }, word);
  element.addEventListener("click", () => {
    if (wanted !== "remove" || confirm(`Have this robot forget task ${task.number}, ${task.name}?`)) act({ do: wanted, number: task.number });
  });
  return element;
}

/** The form that adds a task to this robot. */
export function beginAdding() {
  const add = byId("add");
  add.hidden = false;
  add.querySelector("form").addEventListener("submit", (event) => {
    event.preventDefault();
    const given = new FormData(event.target);
    const number = (key) => Number(given.get(key));
    const task = { number: number("number"), name: given.get("name"), actions: [{ [given.get("action")]: number("seconds") }] };
    if (given.get("x_m") !== "" && given.get("y_m") !== "") {
      task.place = { x_m: number("x_m"), y_m: number("y_m") };
      task.actions.unshift("go to place");
    }
    if (number("robots") > 1) task.robots = number("robots");
    if (given.has("on_demand")) task.on_demand = true;
    act({ do: "add", task });
  });
}

export function showAlarms(message) {
  const list = alarms.querySelector("ul");
  renew(list, message.alarms, () => message.alarms.map((alarm) => make("li", {}, alarm.text)));
  alarms.hidden = message.alarms.length === 0;
}

export function showLevel(message) {
  meter.hidden = false;
  const at = (dbfs) => Math.min(Math.max((dbfs - LOWEST_DBFS) / -LOWEST_DBFS, 0), 1);
  const level = meter.querySelector(".level");
  level.style.setProperty("--at", at(message.level_dbfs));
  level.classList.toggle("loud", message.level_dbfs > LOUD_DBFS);
  meter.querySelector(".floor").style.setProperty("--at", at(message.floor_dbfs));
  setText(meter.querySelector(".figure"), `${Math.round(message.level_dbfs)} dBFS`);
  meter.setAttribute("aria-valuenow", Math.max(Math.round(message.level_dbfs), LOWEST_DBFS));
  meter.setAttribute("aria-valuetext", `${Math.round(message.level_dbfs)} decibels below full scale`);
}
