"""Style and script of the page: calm, readable, light or dark as the reader's system is."""

STYLE = """
:root { --ink: #23272c; --soft: #5d656e; --page: #fdfcfa; --card: #f4f2ee; --line: #dedad2; --accent: #3d7fb8;
  --caution: #f8efdf; --caution-line: #d07a2c; color-scheme: light dark; }
@media (prefers-color-scheme: dark) { :root { --ink: #e4e2de; --soft: #a2a8ae; --page: #191b1e; --card: #212428;
  --line: #363b41; --accent: #6fa8d8; --caution: #2d261c; } }
* { box-sizing: border-box; }
body { margin: 0; background: var(--page); color: var(--ink); line-height: 1.55;
  font: 16px/1.55 system-ui, "Segoe UI", "Helvetica Neue", Arial, sans-serif; font-variant-numeric: tabular-nums; }
main, header, footer { max-width: 1120px; margin: 0 auto; padding: 0 28px; }
header { padding-top: 44px; }
h1 { font-size: 1.75rem; font-weight: 600; margin: 0 0 4px; letter-spacing: -0.01em; }
h2 { font-size: 1.25rem; font-weight: 600; margin: 52px 0 10px; padding-top: 14px; border-top: 1px solid var(--line); }
header p, figcaption, caption, footer { color: var(--soft); font-size: 0.9rem; }
p, ul { max-width: 78ch; }
nav { display: flex; flex-wrap: wrap; gap: 4px 18px; margin: 18px 0 0; font-size: 0.92rem; }
a { color: var(--accent); text-decoration: none; }
a:hover { text-decoration: underline; }
code, pre { font: 0.87em/1.5 ui-monospace, "SF Mono", Menlo, Consolas, monospace; }
code { background: var(--card); padding: 1px 3px; border-radius: 4px; }
pre { background: var(--card); padding: 12px 16px; border-radius: 8px; overflow-x: auto; }
dl { display: grid; grid-template-columns: max-content 1fr; gap: 8px 22px; background: var(--card); border-radius: 10px;
  padding: 18px 22px; margin: 16px 0; }
dt { color: var(--soft); max-width: 22ch; }
dd { margin: 0; }
.caution { background: var(--caution); border-left: 3px solid var(--caution-line); border-radius: 0 8px 8px 0;
  padding: 9px 16px; margin: 10px 0; max-width: none; }
.scroll { overflow-x: auto; margin: 16px 0; }
table { border-collapse: collapse; font-size: 0.87rem; min-width: 40%; }
caption { caption-side: bottom; text-align: left; padding-top: 7px; }
th { text-align: left; font-weight: 600; color: var(--soft); vertical-align: bottom; max-width: 15ch; }
th, td { padding: 5px 14px 5px 0; border-bottom: 1px solid var(--line); }
td { white-space: nowrap; }
td.sentence { white-space: normal; min-width: 40ch; }
.number { text-align: right; }
figure { margin: 22px 0; }
figcaption { margin-top: 6px; }
details { margin: 14px 0; }
summary { cursor: pointer; color: var(--accent); }
footer { margin-top: 60px; padding-bottom: 40px; }
@media (max-width: 700px) { dl { grid-template-columns: 1fr; gap: 2px; } dd { margin-bottom: 8px; } }
"""

SCRIPT = """
const dark = window.matchMedia("(prefers-color-scheme: dark)");
const ofPage = name => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
function template() {
  const axis = { gridcolor: ofPage("--line"), linecolor: ofPage("--line"), zerolinecolor: ofPage("--soft"),
    zeroline: false, ticks: "outside", tickcolor: ofPage("--line") };
  const layout = { paper_bgcolor: "rgba(0,0,0,0)", plot_bgcolor: "rgba(0,0,0,0)",
    font: { color: ofPage("--ink"), family: getComputedStyle(document.body).fontFamily, size: 12.5 },
    modebar: { bgcolor: "rgba(0,0,0,0)", color: ofPage("--line"), activecolor: ofPage("--accent") } };
  for (const k of ["", "2", "3", "4", "5", "6"]) { layout["xaxis" + k] = axis; layout["yaxis" + k] = axis; }
  return { layout };
}
const charts = [...document.querySelectorAll("figure > script")].map(source => {
  const place = source.nextElementSibling, chart = JSON.parse(source.textContent);
  Plotly.newPlot(place, chart.data, { ...chart.layout, template: template() }, { ...config, responsive: true });
  return place;
});
dark.addEventListener("change", () => charts.forEach(place => Plotly.relayout(place, { template: template() })));
"""
