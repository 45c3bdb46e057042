// A board draws what its address (#/study/ID.json) says, and asks every two seconds whether that has changed.
import { element } from "/shell/element.js";

const ASK_MS = 2000;
const place = document.getElementById("board");
const outer = window.parent !== window ? window.parent : null;
let tag = "", shown = null;

function isLight() {
  if (outer) return outer.document.documentElement.classList.contains("light");
  return !matchMedia("(prefers-color-scheme: dark)").matches;
}

function template() {
  const of = name => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
  const axis = { gridcolor: of("--line"), linecolor: of("--line"), zerolinecolor: of("--soft"), zeroline: false,
    ticks: "outside", tickcolor: of("--line") };
  const layout = { paper_bgcolor: "rgba(0,0,0,0)", plot_bgcolor: "rgba(0,0,0,0)",
    font: { color: of("--ink"), family: getComputedStyle(document.body).fontFamily, size: 12 },
    modebar: { bgcolor: "rgba(0,0,0,0)", color: of("--soft"), activecolor: of("--accent") } };
  for (const k of ["", "2", "3", "4", "5", "6"]) { layout["xaxis" + k] = axis; layout["yaxis" + k] = axis; }
  return { layout };
}

const CONFIG = { displaylogo: false, responsive: true, showSendToCloud: false, plotlyServerURL: "",
  modeBarButtonsToRemove: ["select2d", "lasso2d"], toImageButtonOptions: { format: "svg" } };

// A chart is drawn once it comes into sight: a dozen at once would hold a slow machine for seconds.
const sight = new IntersectionObserver(entries => {
  for (const entry of entries) if (entry.isIntersecting) { sight.unobserve(entry.target); draw(entry.target); }
}, { rootMargin: "200px" });

function draw(box) {
  const chart = box.chart;
  const layout = { ...chart.spec.layout, height: undefined, template: template() };
  Plotly.react(box, chart.spec.data, layout, CONFIG);
}

function figure(chart) {
  const box = element("div", { class: "chart", role: "img", "aria-label": `${chart.title}. ${chart.caption}` });
  box.chart = chart;
  box.style.aspectRatio = String(1 / Math.max(chart.aspect, 0.5));
  sight.observe(box);
  return element("figure", {}, element("h2", {}, chart.title), box, element("p", { class: "caption" }, chart.caption));
}

function number(text) {
  const found = /^[±\s]*([−+-]?\d[\d.]*)/.exec(text.replace("−", "-"));
  return found ? Number(found[1]) : NaN;
}

function table(one) {
  const rows = one.rows.map((cells, k) => ({ cells, open: one.opens[k] }));
  const body = element("tbody");
  const fill = () => body.replaceChildren(...rows.filter(matches).map(row => element("tr",
    row.open ? { class: "opens", tabindex: "0", onclick: () => outer?.explorer?.send(row.open),
      onkeydown: event => { if (event.key === "Enter") outer?.explorer?.send(row.open); } } : {},
    ...row.cells.map(cell => element("td", {}, cell)))));
  const filter = element("input", { type: "search", placeholder: "Filter", "aria-label": `Filter ${one.title}`,
    oninput: fill });
  const matches = row => !filter.value || row.cells.join(" ").toLowerCase().includes(filter.value.toLowerCase());
  let column = -1, sign = 1;
  const sort = k => {
    sign = k === column ? -sign : 1;
    column = k;
    rows.sort((a, b) => {
      const [x, y] = [number(a.cells[k]), number(b.cells[k])];
      if (!Number.isNaN(x) && !Number.isNaN(y)) return sign * (x - y);
      return sign * a.cells[k].localeCompare(b.cells[k]);
    });
    head.forEach((cell, at) => cell.setAttribute("aria-sort",
      at !== k ? "none" : sign > 0 ? "ascending" : "descending"));
    fill();
  };
  const head = one.header.map((name, k) => element("th", { scope: "col" },
    element("button", { onclick: () => sort(k), title: "Sort" }, name)));
  fill();
  const whole = element("table", {}, element("caption", {}, one.caption), element("thead", {}, element("tr", {}, ...head)), body);
  const parts = one.rows.length > 12 ? [filter, whole] : [whole];
  if (!one.folded) return element("section", {}, element("h2", {}, one.title), ...parts);
  return element("details", {}, element("summary", {}, one.title), ...parts);
}

function show(board) {
  const open = new Set([...place.querySelectorAll("details[open] > summary")].map(one => one.textContent));
  const at = window.scrollY;
  const parts = [];
  if (board.title || board.subtitle) parts.push(element("header", {}, element("h1", {}, board.title),
    element("p", { class: "soft" }, board.subtitle)));
  if (board.banner) parts.push(element("div", { class: `banner ${board.banner.tone}`, role: "status" },
    element("strong", {}, board.banner.headline), element("p", {}, board.banner.why),
    element("p", {}, element("b", {}, "Next: "), board.banner.then),
    ...(outer?.explorer ? board.acts : []).map(one => element("button", { class: "act",
      onclick: () => { outer.explorer.send(one.command); if (one.room) outer.explorer.openRoom(one.room); } }, one.label))));
  if (board.report) parts.push(element("p", {}, element("a", { href: board.report, target: "_blank", rel: "noopener" },
    "Open the report")));
  if (board.stages.length) parts.push(table({ title: "Stages", header: ["Stage", "Pours", "", "Found"], caption: "",
    rows: board.stages.map(one => [one.name, one.count, one.mark, one.found]), opens: [], folded: false }));
  const folded = board.tables.filter(one => one.folded), first = board.tables.filter(one => !one.folded);
  parts.push(...first.map(table), element("div", { class: "grid" }, ...board.charts.map(figure)), ...folded.map(table));
  if (!parts.length || (!board.title && !board.subtitle)) {
    parts.unshift(element("p", { class: "empty" }, "Nothing to show yet. What is started above appears here, and so does what is chosen under Other results."));
  }
  // A chart that is only taken away keeps its listener of the window's size, and a 3-D one its WebGL context.
  for (const box of place.querySelectorAll(".js-plotly-plot")) Plotly.purge(box);
  place.replaceChildren(...parts);
  for (const one of place.querySelectorAll("details")) if (open.has(one.firstChild.textContent)) one.open = true;
  window.scrollTo(0, at);
}

function follow() {
  const light = isLight();
  if (document.documentElement.classList.contains("light") === light) return;
  document.documentElement.classList.toggle("light", light);
  if (shown) show(shown);
}

async function ask() {
  follow();
  const address = location.hash.slice(1);
  try {
    const answer = await fetch(address, { headers: tag ? { "If-None-Match": tag } : {} });
    if (answer.status === 200) {
      tag = answer.headers.get("ETag") || "";
      shown = await answer.json();
      show(shown);
    }
  } catch { /* the server is gone or busy: ask again */ }
  setTimeout(ask, ASK_MS);
}
document.documentElement.classList.toggle("light", isLight());
ask();
