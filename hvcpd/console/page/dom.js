// Elements made so that nothing that was heard can be read as markup: text is always text.

export const byId = (id) => document.getElementById(id);

/** An element: `make("p", {class: "soft"}, "text", child)`; children that are null are left out. */
export function make(name, attributes = {}, ...children) {
  const element = document.createElement(name);
  for (const [key, value] of Object.entries(attributes)) {
    if (value !== null && value !== undefined && value !== false) element.setAttribute(key, value === true ? "" : value);
  }
  element.append(...children.filter((child) => child !== null && child !== undefined));
  return element;
}

/** A drawing that the console itself has made, as its SVG text. */
export const drawing = (svg) => document.adoptNode(new DOMParser().parseFromString(`<body>${svg}</body>`, "text/html").querySelector("svg"));

const SVG = "http://www.w3.org/2000/svg";

export function makeSvg(name, attributes = {}) {
  const element = document.createElementNS(SVG, name);
  for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
  return element;
}

/** Set an element's text if it is another one: a screen reader tells each change. */
export function setText(element, text) {
  if (element.textContent !== text) element.textContent = text;
}

const days = new Intl.DateTimeFormat(undefined, { weekday: "long", day: "numeric", month: "long" });
const times = new Intl.DateTimeFormat(undefined, { hour: "2-digit", minute: "2-digit", second: "2-digit" });

/** The wall's time of a live line. */
export const wallClock = { time: (at) => times.format(at * 1000), day: (at) => days.format(at * 1000) };

/** A recorded mission's time, in minutes and seconds. */
export const missionClock = {
  time: (at) => `${Math.floor(Math.round(at) / 60)}:${String(Math.round(at) % 60).padStart(2, "0")}`, // as the report
  day: () => "",
};
