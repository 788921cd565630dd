// Draws the page's scenes and figures: unpacks them and their libraries, follows light and dark, paper and legends.
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
    }
    return {
      ...layout, uirevision: "kept", paper_bgcolor: "rgba(0,0,0,0)", plot_bgcolor: "rgba(0,0,0,0)",
      font: { ...layout.font, color: ink },
      hoverlabel: { bgcolor: night ? "#2a323b" : "#ffffff", font: { color: ink } },
    };
  }

  let figures = {}, hidden = {}, logarithmic = {};
  for (const button of document.querySelectorAll('.legend [data-traces][aria-pressed="false"]')) {
    const name = button.dataset.figure;
    hidden[name] = [...(hidden[name] ?? []), ...button.dataset.traces.split(" ").map(Number)];
  }
  function draw(name, night, width) {
    const place = document.getElementById(name), given = figures[name];
    const data = recoloured(given.data, night);
    data.forEach((trace, k) => { trace.visible = !(hidden[name] ?? []).includes(k); });
    const layout = themed(given.layout, night);
    if (logarithmic[name]) {
      layout.yaxis = { ...layout.yaxis, type: "log", autorange: true, range: undefined, exponentformat: "none" };
      layout.annotations = [];  // they stand at heights of the linear axis
    }
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
    if (button.dataset.log) {
      logarithmic[button.dataset.log] = show;
      draw(button.dataset.log, dark.matches);
      return;
    }
    const traces = button.dataset.traces.split(" ").map(Number), name = button.dataset.figure;
    const others = (hidden[name] ?? []).filter((trace) => !traces.includes(trace));
    hidden[name] = show ? others : [...others, ...traces];
    draw(name, dark.matches);
  }

  // What can be read is shown before libraries keep the page busy; a hidden page has no frames.
  const shown = new Promise((next) => {
    setTimeout(next, 1000);
    new PerformanceObserver((entries) => {
      if (entries.getEntriesByName("first-contentful-paint").length) next();
    }).observe({ type: "paint", buffered: true });
  });

  function run(text) {
    const script = document.createElement("script");
    script.textContent = text;
    document.head.append(script);
  }

  const measured = (name) => { document.documentElement.dataset[name] ??= String(Math.round(performance.now())); };
  const idle = () => new Promise((next) => (self.requestIdleCallback ?? setTimeout)(next, { timeout: 200 }));

  // A machine without WebGL keeps the pictures.
  async function showScenes() {
    if (!document.getElementById("three")) return;
    try {
      const [three, scenes] = await Promise.all([unpacked("three"), unpacked("scenes")]);
      run(three);
      document.scenes = {};
      for (const [name, scene] of Object.entries(JSON.parse(scenes))) {
        document.scenes[name] = showScene(document.getElementById(name), scene);
        measured("scene");
        await idle();
      }
    } catch (error) {
      document.documentElement.dataset.scene = "none";
      console.warn(error);
    }
  }

  for (const button of document.querySelectorAll(".command button")) {
    button.addEventListener("click", async () => {
      const code = button.previousElementSibling;
      getSelection().selectAllChildren(code);
      try {
        await navigator.clipboard.writeText(code.textContent);
      } catch {
        document.execCommand("copy");  // a page from a file has no clipboard of its own
      }
      button.textContent = "Copied";
      setTimeout(() => { button.textContent = "Copy"; }, 1500);
    });
  }

  // Within a notebook the frame is as high as what it shows.
  if (location.href === "about:srcdoc" && frameElement) {
    new ResizeObserver(() => { frameElement.style.height = `${document.documentElement.scrollHeight}px`; }).observe(document.body);
  }

  await shown;
  measured("first");
  await showScenes();
  if (document.getElementById("plotly")) {
    try {
      await idle();
      const [plotly, data] = await Promise.all([unpacked("plotly"), unpacked("figures")]);
      run(plotly);
      figures = JSON.parse(data);
    } catch (error) {
      document.getElementById("trouble").hidden = false;
      throw error;
    }
  }
  const all = (night, width) => Object.keys(figures).forEach((name) => draw(name, night, width));
  for (const name of Object.keys(figures)) {
    draw(name, dark.matches);
    await idle();  // the page answers in between
  }
  measured("drawn");
  dark.addEventListener("change", () => all(dark.matches));
  addEventListener("beforeprint", () => all(false, paper));
  addEventListener("afterprint", () => all(dark.matches));
  for (const button of document.querySelectorAll(".legend button")) {
    button.addEventListener("click", () => legend(button));
  }
})();
