// Shows a scene in space: robots that move along their paths, and how far their tools are off.
function showScene(place, scene, colours) {
  "use strict";
  const canvas = document.createElement("canvas");
  const renderer = new THREE.WebGLRenderer({ canvas, antialias: true, alpha: true, preserveDrawingBuffer: true });
  renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
  const world = new THREE.Scene(), camera = new THREE.PerspectiveCamera(35, 1, 1e-3, 200);
  camera.up.set(0, 0, 1);
  const sun = new THREE.DirectionalLight(0xffffff, 2.0);
  sun.position.set(2, -3, 5);
  world.add(sun, new THREE.AmbientLight(0xffffff, 1.6));
  const dark = matchMedia("(prefers-color-scheme: dark)");
  const stage = place.querySelector(".stage"), controls = new THREE.OrbitControls(camera, canvas);
  controls.enableDamping = false;
  const state = {
    time: 0, playing: false, speed: 1, exaggeration: 1, shown: new Set(), component: 0, field: null,
    whole: true, gears: "off", mode: -1, apart: false,
  };
  place.classList.add("live");
  stage.append(canvas);
  stage.tabIndex = 0;
  stage.setAttribute("role", "application");

  // ---------------------------------------------------------------- values over time
  // Row before a time, and the share of the way to the next one.
  function at(times, time) {
    let low = 0, high = times.length - 1;
    if (time <= times[0]) return [0, 0];
    if (time >= times[high]) return [Math.max(high - 1, 0), high ? 1 : 0];
    while (high - low > 1) {
      const middle = (low + high) >> 1;
      if (times[middle] <= time) low = middle; else high = middle;
    }
    return [low, (time - times[low]) / (times[high] - times[low])];
  }
  const mixed = (rows, [row, share]) =>
    rows[row].map((value, k) => value + share * ((rows[Math.min(row + 1, rows.length - 1)])[k] - value));

  // ---------------------------------------------------------------- colours
  // A deviation from blue (into the part) by grey to orange (away from it): apart for colour-blind eyes too.
  const ends = [[0, 90, 181], [200, 200, 200], [220, 80, 0]];
  function diverging(value) {
    const part = Math.max(-1, Math.min(1, value)), other = part < 0 ? ends[0] : ends[2], share = Math.abs(part);
    return ends[1].map((grey, k) => (grey + share * (other[k] - grey)) / 255);
  }
  const length = (metres) => {
    const size = Math.abs(metres);
    if (size < 1e-6) return "< 1 um";
    if (size < 9.995e-5) return `${Number((1e6 * metres).toPrecision(3))} um`;
    return `${Number((1e3 * metres).toPrecision(3))} mm`;
  };

  // ---------------------------------------------------------------- robots
  const metal = new THREE.MeshLambertMaterial({ color: 0xd98324, side: THREE.DoubleSide });
  const iron = new THREE.MeshLambertMaterial({ color: 0x9aa4ae, side: THREE.DoubleSide });
  const steel = iron.clone();
  const upward = new THREE.Vector3(0, 1, 0);
  function rod(from, to, wide, narrow, material) {
    const way = new THREE.Vector3().subVectors(to, from);
    const mesh = new THREE.Mesh(new THREE.CylinderGeometry(narrow, wide, way.length(), 20), material);
    mesh.position.copy(from).addScaledVector(way, 0.5);
    if (way.length() > 0) mesh.quaternion.setFromUnitVectors(upward, way.normalize());
    return mesh;
  }
  function surface(part, material) {
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute("position", new THREE.BufferAttribute(new Float32Array(part.points.flat()), 3));
    geometry.setIndex(part.triangles.flat());
    const flat = geometry.toNonIndexed();
    flat.computeVertexNormals();
    return new THREE.Mesh(flat, material);
  }
  function placed(group, pose) {
    group.position.set(...pose.slice(0, 3));
    group.quaternion.set(...pose.slice(3));
    return group;
  }
  const robots = scene.robots.map((robot) => {
    const base = placed(new THREE.Group(), robot.base), bodies = [base], gears = [];
    const reach = robot.origins.reduce((sum, origin) => sum + Math.hypot(...origin), 0) || 1;
    const thick = (k) => reach * 0.045 * (1 - 0.7 * k / robot.axes.length);
    robot.axes.forEach((axis, k) => {
      const body = new THREE.Group();
      body.position.set(...robot.origins[k]);
      bodies[k].add(body);
      bodies.push(body);
      const gear = new THREE.MeshLambertMaterial({ color: 0x5d6873 });
      const turn = new THREE.Vector3(...axis), half = thick(k) * 1.25;
      if (!robot.meshes.length) {
        body.add(rod(turn.clone().multiplyScalar(-half), turn.clone().multiplyScalar(half), thick(k) * 1.15, thick(k) * 1.15, gear));
      } else {
        const ring = rod(turn.clone().multiplyScalar(-half * 0.2), turn.clone().multiplyScalar(half * 0.2), thick(k) * 2.2, thick(k) * 2.2, gear);
        ring.visible = false;
        body.add(ring);
      }
      gears.push({ material: gear, mesh: body.children[0], axis: turn });
    });
    const tool = placed(new THREE.Group(), robot.tool_pose);
    bodies[bodies.length - 1].add(tool);
    const zero = new THREE.Vector3();
    if (robot.meshes.length) {
      for (const part of robot.meshes) bodies[part.body].add(surface(part, part.body ? metal : iron));
    } else {
      robot.origins.forEach((origin, k) => {
        if (Math.hypot(...origin) > 1e-6) {
          bodies[k].add(rod(zero, new THREE.Vector3(...origin), thick(k), thick(k + 0.6), k ? metal : iron));
        }
      });
    }
    const wide = robot.tool ? robot.tool.diameter / 2 : reach * 0.0012;
    const tip = new THREE.Vector3(robot.tool && robot.tool.is_round ? -wide : 0, 0, 0);
    const grip = new THREE.Vector3(...robot.tool_pose.slice(0, 3)).length();
    const shaft = new THREE.Vector3(-Math.max(Math.min(grip, 0.2 * reach), 8 * wide), 0, 0);
    tool.add(rod(shaft, tip, wide, wide, steel));
    if (robot.tool && robot.tool.is_round) {
      const ball = new THREE.Mesh(new THREE.SphereGeometry(wide, 24, 16), steel);
      ball.position.copy(tip);
      tool.add(ball);
    }
    const flange = new THREE.Vector3(...robot.tool_pose.slice(0, 3));
    if (!robot.meshes.length && flange.length() > 1e-6) {
      tool.updateMatrix();
      const end = shaft.clone().applyMatrix4(tool.matrix);
      bodies[bodies.length - 1].add(rod(zero, end, thick(robot.axes.length), wide * 1.6, metal));
    }
    world.add(base);
    const largest = robot.torque ? robot.axes.map((_, k) => Math.max(...robot.torque.map((row) => Math.abs(row[k])), 1e-9)) : null;
    return { ...robot, node: base, bodies, gears, tool, largest, reach };
  });
  // Gear of a joint at a time: 1 upper flank, -1 lower one, 0 in its backlash, null not known.
  function flank(robot, joint, time) {
    const steps = robot.flanks[joint];
    if (steps) {
      let value = steps[0][1];
      for (const [from, next] of steps) { if (from <= time) value = next; else break; }
      return value;
    }
    return robot.torque ? Math.sign(mixed(robot.torque, at(robot.time, time))[joint]) : null;
  }
  function pose(robot, time, swing) {
    const where = at(robot.time, time), q = mixed(robot.q, where);
    const torque = robot.torque ? mixed(robot.torque, where) : null;
    robot.gears.forEach((gear, k) => {
      const angle = q[k] + (swing ? swing[k] : 0);
      robot.bodies[k + 1].quaternion.setFromAxisAngle(gear.axis, angle);
      let colour = [0.36, 0.41, 0.45];
      if (state.gears === "torque" && torque) colour = diverging(torque[k] / robot.largest[k]);
      if (state.gears === "flank") {
        const side = flank(robot, k, time);
        colour = side === 0 ? [1.0, 0.9, 0.2] : side === null ? colour : diverging(side);
      }
      gear.material.color.setRGB(...colour, "srgb");
      gear.mesh.visible = !robot.meshes.length || state.gears !== "off";
    });
  }

  // ---------------------------------------------------------------- paths
  const names = [...new Set([...scene.tracks, ...scene.surfaces].map((thing) => thing.name))].filter(Boolean);
  const size = Math.max(...[0, 1, 2].map((k) => {
    const values = scene.tracks.flatMap((track) => track.desired.map((point) => point[k]));
    return values.reduce((a, b) => Math.max(a, b), -Infinity) - values.reduce((a, b) => Math.min(a, b), Infinity);
  }), 1e-3);
  const largest = (chosen, pick) => Math.max(1e-9, ...scene.tracks.filter(chosen).map(
    (track) => track.signed.reduce((most, row) => Math.max(most, pick(row)), 0)));
  const pick = () => state.component === 3 ? (row) => Math.hypot(...row) : (row) => Math.abs(row[state.component]);
  function segments(points, colour) {
    const geometry = new THREE.LineSegmentsGeometry(), positions = [], tints = [];
    for (let k = 0; k + 1 < points.length; k++) {
      if (points[k][0] === null || points[k + 1][0] === null) continue;  // a gap
      positions.push(...points[k], ...points[k + 1]);
      if (colour) tints.push(...colour[k], ...colour[k + 1]);
    }
    geometry.setPositions(positions);
    if (colour) geometry.setColors(tints);
    return geometry;
  }
  const tracks = scene.tracks.map((track) => {
    // Behind the actual path where both coincide.
    const behind = { polygonOffset: true, polygonOffsetFactor: 2, polygonOffsetUnits: 8 };
    const ideal = new THREE.LineSegments2(segments(track.desired), new THREE.LineMaterial({ color: 0x77818b, linewidth: 1.2, ...behind }));
    const line = new THREE.LineSegments2(new THREE.LineSegmentsGeometry(), new THREE.LineMaterial({ vertexColors: true, linewidth: 3.5 }));
    const dot = new THREE.Mesh(new THREE.SphereGeometry(0.012 * size, 16, 12), new THREE.MeshLambertMaterial());
    const layer = 1 + names.indexOf(track.name);
    line.layers.set(layer);
    dot.layers.set(layer);
    world.add(ideal, line, dot);
    return { ...track, ideal, line, dot };
  });
  let scale = 1;
  const valued = (row) => state.component === 3 ? Math.hypot(...row) : row[state.component];
  function drawTracks() {
    scale = largest((track) => state.whole || state.shown.has(track.name), pick());
    for (const track of tracks) {
      track.line.material.linewidth = state.field ? 0.7 : 3.5;  // a field is seen between thin lines
      const points = track.desired.map((point, k) => point.map((v, i) => v + state.exaggeration * track.deviation[k][i]));
      const tints = track.signed.map((row) => (state.field ? ends[1].map((v) => 0.5 * v / 255) : diverging(valued(row) / scale))
        .map((v) => new THREE.Color().setRGB(v, v, v, "srgb").r));
      track.line.geometry.dispose();
      track.line.geometry = segments(points, tints);
    }
    if (state.field) return;
    const toward = (value) => `${length(Math.abs(value))} ${value < 0 ? "into the part" : "away"}`;
    labelled(state.component === 3 ? 0 : -scale, scale, state.component ? length : toward, state.component === 3 ? "onesided" : "");
  }
  // Writes the ends of the scale of colours, and marks the tolerance on that of deviations.
  function labelled(low, high, words, kind) {
    const bar = place.querySelector(".bar");
    if (!bar) return;
    bar.querySelector(".low").textContent = words(low);
    bar.querySelector(".high").textContent = words(high);
    bar.className = `bar ${kind}`;
    const mark = bar.querySelector(".mark"), share = scene.tolerance ? (scene.tolerance - low) / (high - low) : 2;
    mark.hidden = share > 1 || kind === "rising";
    mark.style.left = `${100 * share}%`;
  }
  for (const line of scene.lines) {
    const shape = new THREE.LineSegments2(segments(line.points), new THREE.LineMaterial({ color: line.color, linewidth: 2 }));
    world.add(shape);
  }

  // ---------------------------------------------------------------- the part, and workpieces
  const sheet = new THREE.MeshLambertMaterial({
    vertexColors: true, side: THREE.DoubleSide, polygonOffset: true, polygonOffsetFactor: 2, polygonOffsetUnits: 2,
    transparent: scene.tracks.length > 0, opacity: 0.85, depthWrite: !scene.tracks.length,
  });
  // A workpiece without a name is that of each path.
  const pieces = scene.surfaces.flatMap((piece) => (piece.name ? [piece.name] : names).map((name) => {
    const mesh = surface(piece, sheet);
    mesh.layers.set(1 + names.indexOf(name));
    world.add(mesh);
    return { ...piece, mesh, track: tracks.find((track) => track.name === name) };
  }));
  // From dark to bright, which shades of grey tell as well (after Viridis).
  const ladder = [[68, 1, 84], [59, 82, 139], [33, 145, 140], [94, 201, 98], [253, 231, 37]];
  function rising(part) {
    const place = 4 * Math.max(0, Math.min(1, part)), low = Math.min(Math.floor(place), 3), share = place - low;
    return ladder[low].map((value, k) => (value + share * (ladder[low + 1][k] - value)) / 255);
  }
  function drawPieces() {
    const fields = pieces.map((piece) => piece.fields[state.field]), given = fields.filter(Boolean);
    const finite = given.flat().filter((value) => value !== null);
    const low = finite.reduce((a, b) => Math.min(a, b), Infinity), high = finite.reduce((a, b) => Math.max(a, b), -Infinity);
    const grey = ends[1].map((value) => value / 255), tint = new THREE.Color();
    pieces.forEach((piece, number) => {
      let colours = piece.points.map(() => grey);
      if (fields[number]) {
        colours = fields[number].map((value) => value === null ? grey : rising((value - low) / (high - low || 1)));
      } else if (!state.field && piece.time && piece.track) {
        colours = piece.time.map((time) => time === null ? grey
          : diverging(valued(mixed(piece.track.signed, at(piece.track.time, time))) / scale));
      }
      const tints = piece.triangles.flatMap((corners, k) => corners.flatMap((corner) => {
        tint.setRGB(...colours[colours.length === piece.points.length ? corner : k], "srgb");
        return [tint.r, tint.g, tint.b];
      }));
      piece.mesh.geometry.setAttribute("color", new THREE.BufferAttribute(new Float32Array(tints), 3));
    });
    const unit = state.field?.split("[")[1]?.replace("]", "") ?? "";
    const words = (value) => unit === "mm" ? length(1e-3 * value) : `${Number(value.toPrecision(3))} ${unit}`;
    if (given.length) labelled(low, high, words, "rising");
  }
  function recolour() {
    drawTracks();
    drawPieces();
    changed();
  }
  if (scene.tracks.length) {
    const grid = new THREE.GridHelper(1, 10, 0x8b95a0, 0x8b95a0);
    grid.material.transparent = true;
    grid.material.opacity = 0.35;
    const ground = placed(new THREE.Group(), scene.part);
    grid.rotation.x = Math.PI / 2;
    const inverse = new THREE.Matrix4().compose(ground.position, ground.quaternion, new THREE.Vector3(1, 1, 1)).invert();
    const inPart = scene.tracks.flatMap((track) => track.desired).map((p) => new THREE.Vector3(...p).applyMatrix4(inverse));
    const middle = (key) => 0.5 * (inPart.reduce((a, p) => Math.max(a, p[key]), -Infinity) + inPart.reduce((a, p) => Math.min(a, p[key]), Infinity));
    grid.position.set(middle("x"), middle("y"), 0);
    grid.scale.setScalar(1.6 * size);
    ground.add(grid);
    world.add(ground);
  }

  // ---------------------------------------------------------------- views
  const centre = new THREE.Vector3(), all = scene.tracks.flatMap((track) => track.desired);
  for (const point of all) centre.add(new THREE.Vector3(...point).divideScalar(all.length));
  const partUp = new THREE.Vector3(0, 0, 1).applyQuaternion(new THREE.Quaternion(...scene.part.slice(3)));
  const partX = new THREE.Vector3(1, 0, 0).applyQuaternion(new THREE.Quaternion(...scene.part.slice(3)));
  const partY = new THREE.Vector3().crossVectors(partUp, partX);
  const views = {
    part: () => {
      const from = partUp.clone().multiplyScalar(0.75).addScaledVector(partY, -0.9).addScaledVector(partX, 0.45).normalize();
      look(centre, from, 2.1 * size);
    },
    above: () => look(centre, partUp.clone().addScaledVector(partY, -1e-3).normalize(), 2.1 * size),
    robot: () => {
      world.updateMatrixWorld(true);
      const box = new THREE.Box3(), base = new THREE.Vector3();
      for (const robot of robots) {
        box.expandByObject(robot.node);
        base.addScaledVector(robot.node.position, 1 / robots.length);
      }
      const to = centre.clone().sub(base), middle = box.expandByPoint(centre).getCenter(new THREE.Vector3());
      const extent = box.getSize(new THREE.Vector3());
      const side = new THREE.Vector3(to.y, -to.x, 0);
      if (side.length() < 1e-3) side.set(0.3, -1, 0);
      look(middle, side.normalize().addScaledVector(upward.set(0, 0, 1), 0.35).normalize(), 1.15 * Math.max(extent.x, extent.y, extent.z));
      upward.set(0, 1, 0);
    },
  };
  // All that is there, where nothing moves along a path.
  views.all = () => {
    world.updateMatrixWorld(true);
    const box = new THREE.Box3().setFromObject(world), extent = box.getSize(new THREE.Vector3());
    look(box.getCenter(new THREE.Vector3()), new THREE.Vector3(0.6, -1, 0.6).normalize(), 1.15 * Math.max(extent.x, extent.y, extent.z));
  };
  let view = "part";
  // `extent` fills the narrower side of the stage.
  function look(target, from, extent) {
    const panes = state.apart ? Math.max(state.shown.size, 1) : 1, narrow = Math.min(1, camera.aspect / panes), half = Math.tan(0.5 * camera.fov * Math.PI / 180);
    controls.target.copy(target);
    camera.position.copy(target).addScaledVector(from, 0.5 * extent / (half * narrow));
    camera.up.copy(Math.abs(from.z) > 0.99 ? partY : new THREE.Vector3(0, 0, 1));
    controls.update();
  }

  // ---------------------------------------------------------------- drawing
  let waiting = false;
  function changed() {
    if (waiting) return;
    waiting = true;
    requestAnimationFrame(draw);
  }
  function draw(now) {
    waiting = false;
    if (state.playing) {
      const ahead = Math.min((now - (state.last ?? now)) / 1000, 0.1);
      state.time += ahead * state.speed;
      if (state.time > period[1]) state.time = period[0];
      moved();
    }
    state.last = now;
    const chosen = names.filter((name) => state.shown.has(name));
    const mode = state.mode >= 0 ? robots[0].modes[state.mode] : null;
    for (const robot of robots) {
      const swing = mode && robot === robots[0] ? mode.amplitude.map((a) => a * 0.12 * Math.sin(now / 250)) : null;
      pose(robot, state.time, swing);
    }
    for (const track of tracks) {
      const where = at(track.time, state.time);
      track.dot.material.color.set(dark.matches ? 0xffffff : 0x1c2329);
      track.dot.position.set(...mixed(track.desired, where)).addScaledVector(new THREE.Vector3(...mixed(track.deviation, where)), state.exaggeration);
    }
    const wide = stage.clientWidth, high = stage.clientHeight;
    const panes = state.apart && chosen.length > 1 ? chosen.map((name) => [name]) : [chosen];
    renderer.setScissorTest(panes.length > 1);
    panes.forEach((pane, k) => {
      const width = wide / panes.length;
      renderer.setViewport(k * width, 0, width, high);
      renderer.setScissor(k * width, 0, width, high);
      camera.aspect = width / high;
      camera.updateProjectionMatrix();
      camera.layers.set(0);
      for (const name of pane) camera.layers.enable(1 + names.indexOf(name));
      renderer.render(world, camera);
    });
    place.querySelector(".panes").replaceChildren(...(panes.length > 1 ? chosen : []).map((name) => {
      const label = document.createElement("span");
      label.append(document.createElement("b"));
      label.firstChild.textContent = name;
      return label;
    }));
    place.dataset.shown = String(Number(place.dataset.shown ?? 0) + 1);
    if (state.playing || mode) changed();
  }
  function fitted() {
    const wide = stage.clientWidth, high = stage.clientHeight;
    if (!wide || !high) return;
    renderer.setSize(wide, high, false);
    camera.aspect = wide / high;
    changed();
  }

  // ---------------------------------------------------------------- what a visitor does
  const period = [Infinity, -Infinity];
  for (const track of [...scene.tracks, ...robots]) {
    period[0] = Math.min(period[0], track.time[0]);
    period[1] = Math.max(period[1], track.time[track.time.length - 1]);
  }
  if (!(period[0] < Infinity)) period.splice(0, 2, 0, 0);
  const control = (name) => place.querySelector(`[data-control="${name}"]`);
  const clock = control("time"), factor = control("exaggeration");
  function moved() {
    if (clock) {
      clock.value = String(1000 * (state.time - period[0]) / Math.max(period[1] - period[0], 1e-9));
      clock.setAttribute("aria-valuetext", `${state.time.toFixed(3)} s`);
    }
    const lines = tracks.filter((track) => state.shown.has(track.name)).map((track) => {
      const [normal, along, across] = mixed(track.signed, at(track.time, state.time));
      return `${track.robot ? `${track.robot}, ` : ""}${names.length > 1 ? `${track.name}: ` : ""}${length(Math.hypot(normal, along, across))} (normal ${length(normal)}, along ${length(along)}, across ${length(across)})`;
    });
    place.querySelector(".readout").textContent = [...(period[1] > period[0] ? [`t = ${state.time.toFixed(3)} s`] : []), ...lines].join("\n");
  }
  function exaggerate(value) {
    state.exaggeration = Math.max(1, Math.min(1e6, value));
    if (factor) {
      factor.value = String(100 * Math.log10(state.exaggeration));
      const times = Number(state.exaggeration.toPrecision(2)).toLocaleString("en");
      place.querySelector(".factor").textContent = `${times}x`;
      factor.setAttribute("aria-valuetext", `${times} times`);
    }
    recolour();
  }
  // The largest deviation seen is drawn as about a tenth of the part.
  function suited() {
    const most = largest((track) => state.whole || state.shown.has(track.name), (row) => Math.hypot(...row));
    const raw = Math.max(1, 0.1 * size / most), decade = 10 ** Math.floor(Math.log10(raw));
    exaggerate(decade * [5, 2, 1].find((step) => step * decade <= raw));
  }
  function play(on) {
    state.playing = on;
    state.last = undefined;
    control("play").textContent = on ? "Pause" : "Play";
    control("play").setAttribute("aria-pressed", String(on));
    // What is read aloud at each step would never end while it plays.
    place.querySelector(".readout").setAttribute("aria-live", on ? "off" : "polite");
    changed();
  }
  function seek(time) {
    state.time = Math.max(period[0], Math.min(period[1], time));
    moved();
    changed();
  }
  function toggle(name) {
    if (state.shown.has(name)) state.shown.delete(name); else state.shown.add(name);
    if (!state.shown.size) state.shown.add(name);
    for (const button of place.querySelectorAll("[data-track]")) {
      button.setAttribute("aria-pressed", String(state.shown.has(button.dataset.track)));
    }
    recolour();
    moved();
  }
  // Seen from near the robot would hide its part; its tool stays.
  function showRobots(show) {
    const gears = robots.flatMap((robot) => robot.gears.map((gear) => gear.material));
    for (const material of [metal, iron, ...gears]) material.visible = show;
  }
  function look_at(name) {
    view = name;
    showRobots(name === "robot" || name === "all");
    for (const button of place.querySelectorAll("[data-view]")) {
      button.setAttribute("aria-pressed", String(button.dataset.view === name));
    }
    camera.aspect = stage.clientWidth / Math.max(stage.clientHeight, 1);
    views[name]();
    changed();
  }
  state.time = period[0];
  // What is over the whole run lasts half a minute.
  state.speed = Math.max(1, (period[1] - period[0]) / 30);
  for (const button of place.querySelectorAll("[data-track]")) button.addEventListener("click", () => toggle(button.dataset.track));
  for (const button of place.querySelectorAll("[data-view]")) button.addEventListener("click", () => look_at(button.dataset.view));
  const on = (name, event, act) => control(name)?.addEventListener(event, (its) => act(its.target));
  on("play", "click", () => play(!state.playing));
  on("time", "input", (its) => seek(period[0] + its.value / 1000 * (period[1] - period[0])));
  on("exaggeration", "input", (its) => exaggerate(10 ** (its.value / 100)));
  on("colour", "change", (its) => {
    const component = Number(its.value);
    if (Number.isInteger(component)) state.component = component;
    state.field = Number.isInteger(component) ? null : its.value;
    recolour();
  });
  // The desired path would hide the part that it shapes.
  function showPieces(show) {
    for (const piece of pieces) piece.mesh.visible = show;
    for (const track of tracks) track.ideal.visible = !(show && pieces.length);
    changed();
  }
  on("surface", "change", (its) => showPieces(its.checked));
  on("gears", "change", (its) => { state.gears = its.value; if (its.value !== "off") look_at(tracks.length ? "robot" : "all"); changed(); });
  on("mode", "change", (its) => { state.mode = Number(its.value); if (state.mode >= 0) look_at(tracks.length ? "robot" : "all"); changed(); });
  on("apart", "change", (its) => { state.apart = its.checked; look_at(view); });
  on("whole", "change", (its) => { state.whole = its.checked; suited(); });
  stage.addEventListener("keydown", (event) => {
    const step = (event.shiftKey ? 0.001 : 0.01) * (period[1] - period[0]);
    const acts = {
      " ": () => play(!state.playing), ArrowLeft: () => seek(state.time - step), ArrowRight: () => seek(state.time + step),
      Home: () => seek(period[0]), End: () => seek(period[1]), "+": () => exaggerate(2 * state.exaggeration), "-": () => exaggerate(state.exaggeration / 2),
      v: () => look_at(tracks.length ? { part: "above", above: "robot", robot: "part" }[view] : "all"),
    };
    const number = Number(event.key) - 1;
    const act = acts[event.key] ?? (names[number] && (() => toggle(names[number])));
    if (!act || event.ctrlKey || event.metaKey) return;
    event.preventDefault();
    act();
  });
  controls.addEventListener("change", changed);
  new ResizeObserver(fitted).observe(stage);
  dark.addEventListener("change", changed);
  canvas.addEventListener("webglcontextlost", () => place.classList.remove("live"));
  // Before and after beside each other where there is room, else what remains.
  const roomy = stage.clientWidth > 560 && names.length > 1;
  for (const name of roomy ? names.slice(0, 2) : names.slice(0, 2).slice(-1)) state.shown.add(name);
  state.apart = roomy;
  if (control("apart")) control("apart").checked = roomy;
  for (const button of place.querySelectorAll("[data-track]")) {
    button.setAttribute("aria-pressed", String(state.shown.has(button.dataset.track)));
  }
  showPieces(true);
  fitted();
  look_at(scene.tracks.length ? "part" : "all");
  if (tracks.length) suited();
  else if (pieces.length) { state.field = control("colour").value; recolour(); }
  moved();
  if (!tracks.length && control("mode") && !matchMedia("(prefers-reduced-motion: reduce)").matches) {
    state.mode = 0;
    control("mode").value = "0";
    changed();
  }
  return { state, seek, exaggerate, toggle, look_at, play };
}
