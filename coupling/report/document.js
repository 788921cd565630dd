// Draws the page's figures: unpacks them and plotly.js, follows light and dark, paper and legends.
(async () => {
  "use strict";
  const dark = matchMedia("(prefers-color-scheme: dark)");
  const paper = 680;  // width of a printed page between its margins [CSS px]
  // Colours of the light page on the dark one.
  const onDark = JSON.parse(document.getElementById("colours").textContent);

  async function unpacked(id) {
    const packed = await fetch(`data:;base64,${document.getElementById(id).textContent}`);
    const stream = packed.body.pipeThrough(new DecompressionStream("gzip"));
    return new Response(stream).text();
  }

  function recoloured(value, night) {
    if (typeof value === "string") return night ? onDark[value] ?? value : value;
    if (Array.isArray(value)) {
      return typeof value[0] === "object" ? value.map((own) => recoloured(own, night)) : value;
    }
    if (value === null || typeof value !== "object") return value;
    return Object.fromEntries(
      Object.entries(value).map(([key, own]) => [key, recoloured(own, night)]));
  }

  function themed(given, night) {
    const layout = recoloured(given, night);
    const ink = night ? "#d5dbe1" : "#1c2329", grid = night ? "#323a43" : "#e3e7eb";
    const axis = { gridcolor: grid, zerolinecolor: grid, linecolor: grid };
    for (const [key, own] of Object.entries(layout)) {
      if (/^[xy]axis/.test(key)) layout[key] = { ...axis, ...own };
      if (/^scene/.test(key)) {
        for (const name of ["xaxis", "yaxis", "zaxis"]) own[name] = { ...axis, ...own[name] };
      }
    }
    return {
      ...layout, uirevision: "kept", paper_bgcolor: "rgba(0,0,0,0)", plot_bgcolor: "rgba(0,0,0,0)",
      font: { ...layout.font, color: ink },
      hoverlabel: { bgcolor: night ? "#2a323b" : "#ffffff", font: { color: ink } },
    };
  }

  // What is seen in space fills its place, and from farther where that is narrow: it is scaled by its height.
  function framed(layout, width) {
    const farther = Math.max(1, 0.95 * (layout.height ?? 450) / width);
    for (const own of Object.entries(layout).filter(([key]) => /^scene/.test(key)).map((it) => it[1])) {
      if (!layout.updatemenus) layout.margin = { l: 0, r: 0, t: 0, b: 0 };
      const eye = own.camera?.eye;
      if (!eye) continue;
      const from = Object.fromEntries(Object.entries(eye).map(([key, at]) => [key, at * farther]));
      own.camera = { ...own.camera, eye: from };
    }
  }

  let figures, hidden = {};
  function draw(name, night, width) {
    const place = document.getElementById(name), given = figures[name];
    const data = recoloured(given.data, night);
    for (const trace of hidden[name] ?? []) data[trace].visible = false;
    const layout = themed(given.layout, night);
    framed(layout, width || place.clientWidth);
    if (width) {
      const beside = Math.min(2, place.closest(".figures").children.length);
      layout.width = (width - 16 * (beside - 1)) / beside;
    }
    const config = { responsive: !width, displayModeBar: false, doubleClick: "reset" };
    Plotly.react(place, data, layout, config);
  }

  function legend(button) {
    const show = button.getAttribute("aria-pressed") === "false";
    button.setAttribute("aria-pressed", String(show));
    const traces = button.dataset.traces.split(" ").map(Number), name = button.dataset.figure;
    const others = (hidden[name] ?? []).filter((trace) => !traces.includes(trace));
    hidden[name] = show ? others : [...others, ...traces];
    draw(name, dark.matches);
  }

  // What can be read is shown before plotly.js keeps the page busy; a hidden page has no frames.
  const shown = new Promise((next) => {
    setTimeout(next, 200);
    requestAnimationFrame(() => setTimeout(next));
  });

  try {
    const parts = [unpacked("plotly"), unpacked("figures"), shown];
    const script = document.createElement("script");
    [script.textContent, figures] = await Promise.all(parts);
    document.head.append(script);
    figures = JSON.parse(figures);
  } catch (error) {
    document.getElementById("trouble").hidden = false;
    throw error;
  }
  const all = (night, width) => Object.keys(figures).forEach((name) => draw(name, night, width));
  for (const name of Object.keys(figures)) {
    draw(name, dark.matches);
    document.documentElement.dataset.first ??= String(Math.round(performance.now()));
    await new Promise((next) => setTimeout(next));  // the page answers in between
  }
  document.documentElement.dataset.drawn = String(Math.round(performance.now()));
  dark.addEventListener("change", () => all(dark.matches));
  addEventListener("beforeprint", () => all(false, paper));
  addEventListener("afterprint", () => all(dark.matches));
  for (const button of document.querySelectorAll(".legend button")) {
    button.addEventListener("click", () => legend(button));
  }
})();
