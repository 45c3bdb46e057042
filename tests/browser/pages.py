"""Pages that browser tests open in Chromium, which draws in software there."""

FLAGS = [
    "--no-sandbox",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--use-gl=angle",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--ignore-gpu-blocklist",
]
"""WebGL 2 in software: there is no graphics card where tests run."""
PATIENCE = 120_000
"""Milliseconds: software rendering, a solver that compiles its kernels and other work share two cores."""
BEGUN = "try { localStorage.setItem('explorer-begun', 'yes') } catch { /* an empty page has none */ }"
"""Of a browser that has seen the start dialogue."""
PLAIN_EDGES = """{
    const get = HTMLCanvasElement.prototype.getContext;
    HTMLCanvasElement.prototype.getContext = function (kind, how) {
        return get.call(this, kind, kind.startsWith("webgl") ? { ...how, antialias: false } : how);
    };
}"""
"""Drawn in software, a picture of 916 × 1304 pixels takes 0.6 s with smoothed edges, and 0.3 s without."""


def new_page(browser, width=1280, height=900, begun=True, **context):
    """A page of ``browser``; what its console complains about is in ``page.complaints``."""
    page = browser.new_page(viewport={"width": width, "height": height}, **context)
    page.set_default_timeout(PATIENCE)
    page.complaints = []
    page.on("console", lambda said: page.complaints.append(said.text) if said.type == "error" else None)
    page.on("pageerror", lambda error: page.complaints.append(str(error)))
    page.add_init_script(PLAIN_EDGES)
    if begun:
        page.add_init_script(BEGUN)
    return page
