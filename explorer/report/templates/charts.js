const dark = window.matchMedia("(prefers-color-scheme: dark)");
const ofPage = name => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
function template() {
  const axis = { gridcolor: ofPage("--line"), linecolor: ofPage("--line"), zerolinecolor: ofPage("--soft"),
    zeroline: false, ticks: "outside", tickcolor: ofPage("--line") };
  const layout = { paper_bgcolor: "rgba(0,0,0,0)", plot_bgcolor: "rgba(0,0,0,0)",
    font: { color: ofPage("--ink"), family: getComputedStyle(document.body).fontFamily, size: 12.5 },
    modebar: { bgcolor: "rgba(0,0,0,0)", color: ofPage("--tool"), activecolor: ofPage("--accent") } };
  for (const k of ["", "2", "3", "4", "5", "6"]) { layout["xaxis" + k] = axis; layout["yaxis" + k] = axis; }
  return { layout };
}
let charts = [];
// plotly.js stands in the page packed: base64 of gzip.
async function unpack() {
  const packed = Uint8Array.from(atob(document.getElementById("plotly").textContent), one => one.charCodeAt(0));
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("gzip"));
  const script = document.createElement("script");
  script.textContent = await new Response(stream).text();
  document.head.append(script);
}
unpack().then(() => {
  charts = [...document.querySelectorAll("figure > script")].map(source => {
    const place = source.nextElementSibling, chart = JSON.parse(source.textContent);
    Plotly.newPlot(place, chart.data, { ...chart.layout, template: template() }, { ...config, responsive: true });
    return place;
  });
});
dark.addEventListener("change", () => charts.forEach(place => Plotly.relayout(place, { template: template() })));
// On paper: light colours and the width of the sheet, whatever the screen has.
const onPaper = 660;
window.addEventListener("beforeprint", () => {
  document.documentElement.classList.add("printing");
  charts.forEach(place => Plotly.relayout(place, { template: template(), width: onPaper }));
});
window.addEventListener("afterprint", () => {
  document.documentElement.classList.remove("printing");
  charts.forEach(place => Plotly.relayout(place, { template: template(), width: null, autosize: true }));
});
