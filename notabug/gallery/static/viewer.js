"use strict";
// Two float pictures on one canvas: side by side (in a tall window one above the other), wiped, blinked or their difference. What is shown is in the address.
(() => {
  const $ = (id) => document.getElementById(id);
  const canvas = $("picture"), overlay = $("overlay"), stage = $("stage");
  const MODES = ["side", "wipe", "blink", "difference"];
  const MEASURES = ["absolute", "signed", "relative", "flip", "z", "limitation", "bug", "support"];
  const TONES = ["srgb", "linear", "gamma", "reinhard", "false"];
  const CHANNELS = ["C", "R", "G", "B", "A", "L"];
  const TOLERANCE = 0.004;
  const state = { mode: "side", of: "absolute", ev: 0, tone: "srgb", ch: "C", wipe: 0.5, boxes: true, second: false };
  const view = { zoom: 0, x: 0, y: 0 };
  let scenes = [], exhibit = null, a = null, b = null, map = null, terms = null, at = null, kept = false, finding = -1, turn = 0;

  // --- what is loaded: scripts that deliver a picture or a record under its name --------------------------------
  const promised = new Map(), deliveries = new Map();
  globalThis.notabug = {
    site(found) { scenes = found.scenes; start(); },
    shown() { return { a, b, map }; },
    deliver(name, payload) { deliveries.get(name)?.(payload); },
  };
  function load(name) {
    if (!/^[0-9a-f]{16}$/.test(name)) return Promise.reject(new Error("no such picture"));
    if (!promised.has(name)) {
      promised.set(name, new Promise((resolve, reject) => {
        const script = document.createElement("script");
        deliveries.set(name, (payload) => resolve(typeof payload === "string" ? decode(payload) : payload));
        script.addEventListener("error", () => { promised.delete(name); reject(new Error(`data/${name}.js is missing`)); });
        script.src = `data/${name}.js`;
        document.head.append(script);
      }));
    }
    return promised.get(name);
  }
  function decode(text) { // an EXR in base64 as RGBA floats, row 0 at the top
    const bytes = Uint8Array.from(atob(text), (each) => each.charCodeAt(0));
    const { data, width, height } = parseExr(bytes.buffer, 1015);
    const channels = data.length / (width * height);
    const rgba = new Float32Array(4 * width * height);
    for (let y = 0; y < height; y++) {
      for (let x = 0; x < width; x++) {
        const from = channels * ((height - 1 - y) * width + x), to = 4 * (y * width + x);
        for (let c = 0; c < 4; c++) rgba[to + c] = channels === 1 ? (c < 3 ? data[from] : 1) : data[from + c];
      }
    }
    return { width, height, data: rgba };
  }

  // --- drawing ---------------------------------------------------------------------------------------------------
  const gl = canvas.getContext("webgl2", { antialias: false, preserveDrawingBuffer: true });
  const textures = new WeakMap();
  const program = gl && link();
  function link() {
    const made = gl.createProgram();
    for (const [kind, source] of [[gl.VERTEX_SHADER, VERTEX], [gl.FRAGMENT_SHADER, FRAGMENT]]) {
      const shader = gl.createShader(kind);
      gl.shaderSource(shader, source);
      gl.compileShader(shader);
      if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(shader));
      gl.attachShader(made, shader);
    }
    gl.linkProgram(made);
    return made;
  }
  function bind(unit, picture) {
    gl.activeTexture(gl.TEXTURE0 + unit);
    let texture = textures.get(picture);
    if (!texture) {
      texture = gl.createTexture();
      gl.bindTexture(gl.TEXTURE_2D, texture);
      gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA32F, picture.width, picture.height, 0, gl.RGBA, gl.FLOAT, picture.data);
      gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.NEAREST);
      gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MAG_FILTER, gl.NEAREST);
      gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_WRAP_S, gl.CLAMP_TO_EDGE);
      gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_WRAP_T, gl.CLAMP_TO_EDGE);
      textures.set(picture, texture);
    }
    gl.bindTexture(gl.TEXTURE_2D, texture);
  }
  const panes = () => (state.mode === "side" ? 2 : 1);
  const GAIN = 1.15; // A lies above B where that makes both pictures larger by this factor, as in a tall window
  const stacked = () => a && panes() === 2 &&
    Math.min(canvas.width / a.width, canvas.height / 2 / a.height) > GAIN * Math.min(canvas.width / 2 / a.width, canvas.height / a.height);
  const pane = () => canvas.width / (stacked() ? 1 : panes()); // the width of one picture's part of the canvas
  const tall = () => canvas.height / (stacked() ? 2 : 1); // its height
  const origin = () => [pane() / 2 - view.x * view.zoom, tall() / 2 - view.y * view.zoom];

  function draw() {
    if (!a || !b || !gl) return;
    const scale = devicePixelRatio || 1;
    const [width, height] = [Math.round(stage.clientWidth * scale), Math.round(stage.clientHeight * scale)];
    if (canvas.width !== width || canvas.height !== height) {
      for (const each of [canvas, overlay]) { each.width = width; each.height = height; }
    }
    if (!view.zoom) fit(false);
    gl.viewport(0, 0, width, height);
    gl.useProgram(program);
    bind(0, a); bind(1, b); bind(2, map ?? a);
    const set = (name, kind, ...values) => gl[`uniform${kind}`](gl.getUniformLocation(program, name), ...values);
    set("A", "1i", 0); set("B", "1i", 1); set("M", "1i", 2);
    set("size", "2f", a.width, a.height); set("canvas", "2f", width, height);
    set("origin", "2f", ...origin()); set("zoom", "1f", view.zoom);
    set("pane", "2f", pane(), tall());
    set("mode", "1i", MODES.indexOf(state.mode)); set("second", "1i", state.second ? 1 : 0);
    set("wipe", "1f", state.wipe); set("measure", "1i", MEASURES.indexOf(state.of));
    set("mapped", "1i", map ? 1 : 0); set("exposure", "1f", 2 ** state.ev);
    set("tone", "1i", TONES.indexOf(state.tone)); set("channel", "1i", CHANNELS.indexOf(state.ch));
    gl.drawArrays(gl.TRIANGLES, 0, 3);
    stage.classList.toggle("stacked", stacked());
    annotate(scale);
  }
  const COLOURS = { bug: "#ff8a80", limitation: "#6fc3df", convention: "#b9b3ff" };
  function annotate(scale) {
    const pen = overlay.getContext("2d");
    pen.clearRect(0, 0, overlay.width, overlay.height);
    pen.lineWidth = 1.5 * scale;
    for (let part = 0; part < panes(); part++) {
      const [x0, y0] = origin();
      pen.save();
      pen.translate(stacked() ? 0 : part * pane(), stacked() ? part * tall() : 0);
      pen.beginPath();
      pen.rect(0, 0, pane(), tall());
      pen.clip();
      const frame = (x, y, w, h) => pen.strokeRect(x0 + x * view.zoom, y0 + y * view.zoom, w * view.zoom, h * view.zoom);
      if (state.boxes) {
        boxes().forEach(({ kind, box }, index) => {
          pen.strokeStyle = COLOURS[kind] ?? "#fff";
          pen.lineWidth = (index === finding ? 3 : 1.25) * scale;
          pen.setLineDash(kind === "bug" ? [] : kind === "limitation" ? [5 * scale, 4 * scale] : [2 * scale, 3 * scale]);
          frame(box[0], box[1], box[2] - box[0], box[3] - box[1]);
        });
        pen.setLineDash([]);
      }
      if (at) {
        pen.lineWidth = scale;
        pen.strokeStyle = kept ? "#fff" : "rgb(255 255 255 / .6)";
        frame(at[0], at[1], 1, 1);
        if (view.zoom < 8 * scale) { pen.beginPath(); pen.arc(x0 + (at[0] + .5) * view.zoom, y0 + (at[1] + .5) * view.zoom, 7 * scale, 0, 7); pen.stroke(); }
      }
      if (view.zoom >= 56 * scale) numbers(pen, x0, y0, part, scale);
      pen.restore();
    }
    if (state.mode === "side" || state.mode === "wipe") {
      const x = state.mode === "side" ? overlay.width / 2 : overlay.width * state.wipe;
      pen.fillStyle = "#e4e4e4";
      if (stacked()) pen.fillRect(0, (overlay.height - scale) / 2, overlay.width, scale);
      else pen.fillRect(x - scale / 2, 0, scale, overlay.height);
    }
  }
  function numbers(pen, x0, y0, part, scale) { // each pixel's own values, where pixels are large enough
    pen.font = `${10.5 * scale}px ui-monospace, "DejaVu Sans Mono", monospace`;
    pen.textAlign = "center";
    pen.lineJoin = "round";
    const first = [Math.max(0, Math.floor(-x0 / view.zoom)), Math.max(0, Math.floor(-y0 / view.zoom))];
    for (let y = first[1]; y < a.height && y0 + y * view.zoom < tall(); y++) {
      for (let x = first[0]; x < a.width && x0 + x * view.zoom < pane(); x++) {
        const middle = x0 + (x + .5) * view.zoom;
        const shown = state.mode === "side" ? (part ? b : a) : state.mode === "wipe" ? (middle < overlay.width * state.wipe ? a : b) : state.second ? b : a;
        for (let c = 0; c < 3; c++) {
          const value = state.mode === "difference" ? value_of(b, x, y)[c] - value_of(a, x, y)[c] : value_of(shown, x, y)[c];
          const height = y0 + (y + .5) * view.zoom + (c - .75) * 13 * scale;
          pen.strokeStyle = "rgb(0 0 0 / .75)"; pen.lineWidth = 3 * scale;
          pen.strokeText(short(value), middle, height);
          pen.fillStyle = ["#ffb3b3", "#b9f2b9", "#c0d0ff"][c];
          pen.fillText(short(value), middle, height);
        }
      }
    }
  }
  const short = (value) => (Math.abs(value) >= 1e-4 || value === 0 ? value.toPrecision(4) : value.toExponential(1));
  const value_of = (picture, x, y) => picture.data.subarray(4 * (y * picture.width + x), 4 * (y * picture.width + x) + 4);

  // --- which pictures --------------------------------------------------------------------------------------------
  const named = (name) => exhibit.pictures.find((each) => each.name === name);
  const chosen = (slot) => named($(slot).value);
  const render = () => exhibit.renders[chosen("b")?.render ?? chosen("a")?.render ?? -1];
  const boxes = () => (render()?.findings ?? []).flatMap((each) => (each.regions?.length ? each.regions : [each.region]).map((box) => ({ ...each, box })));

  async function open(record, wanted = {}) {
    const mine = ++turn;
    status("loading");
    const found = await load(record);
    if (mine !== turn) return;
    exhibit = found;
    terms = null; at = null; kept = false; finding = -1; view.zoom = 0;
    for (const slot of ["a", "b"]) {
      const groups = new Map();
      for (const each of exhibit.pictures) {
        if (!groups.has(each.kind)) groups.set(each.kind, Object.assign(document.createElement("optgroup"), { label: each.kind }));
        groups.get(each.kind).append(new Option(each.title, each.name));
      }
      $(slot).replaceChildren(...groups.values());
    }
    const first = exhibit.pictures[0]?.name;
    const worth = ["bug", "limitation", "pass"];
    const best = [...exhibit.pictures.filter((each) => each.kind === "render")]
      .sort((p, q) => worth.indexOf(exhibit.renders[p.render].verdict) - worth.indexOf(exhibit.renders[q.render].verdict))[0];
    $("a").value = named(wanted.a)?.name ?? first;
    $("b").value = named(wanted.b)?.name ?? best?.name ?? exhibit.pictures[1]?.name ?? first;
    $("headline").textContent = exhibit.scene;
    $("variant").textContent = exhibit.variant.replaceAll(",", ", ");
    $("claim").textContent = exhibit.claim;
    document.title = `${exhibit.scene}: notabug`;
    if (!first) { status("This scene has no picture here."); return; }
    await choose(wanted);
  }
  async function choose(wanted = {}) {
    const mine = ++turn;
    try {
      const pair = await Promise.all([load(chosen("a").file), load(chosen("b").file)]);
      if (mine !== turn) return;
      [a, b] = pair;
    } catch (error) { status(error.message); return; }
    if (a.width !== b.width || a.height !== b.height) { status("A and B differ in size"); return; }
    if (wanted.zoom) Object.assign(view, { zoom: wanted.zoom, x: wanted.cx, y: wanted.cy });
    if (wanted.at && wanted.at[0] < a.width && wanted.at[1] < a.height) { at = wanted.at; kept = true; }
    describe();
    await measure();
  }
  async function measure() { // the map that a difference needs besides the two pictures
    const mine = ++turn;
    map = null;
    let note = "";
    if (state.mode === "difference") {
      const maps = render()?.maps ?? {};
      try {
        if (state.of === "flip") {
          status("computing FLIP");
          await new Promise((resolve) => setTimeout(resolve, 0));
          map = plane(flip(a, b));
          note = `FLIP of A and B, mean ${mean(map).toPrecision(3)}`;
        } else if (state.of === "z") {
          note = maps.error ? `|A − B| in ${maps.unit}; yellow is 10 and more` : "no renderer's picture is chosen: its noise is needed";
          if (maps.error) map = await load(maps.error);
        } else if (state.of === "limitation" || state.of === "bug") {
          map = maps[state.of] ? await load(maps[state.of]) : plane(new Float32Array(a.width * a.height));
          note = maps[state.of] ? "FLIP from 0, black, to 1, yellow" : `the ${state.of} leg is empty`;
        } else if (state.of === "support") {
          const acting = supporting();
          map = plane(await support(acting));
          note = acting.length ? `where ${acting.map((each) => each.title).join(", ")} can act` : "no limitation acts here";
        } else note = { absolute: "|A − B|", signed: "red: B is brighter; blue: darker", relative: "|A − B| / (larger of both + 0.001)" }[state.of];
      } catch (error) { note = error.message; }
      if (mine !== turn) return;
    }
    status("");
    $("measured").textContent = note;
    refresh();
  }
  const plane = (values) => ({ width: a.width, height: a.height, data: Float32Array.from({ length: 4 * values.length }, (_, i) => (i % 4 < 3 ? values[i >> 2] : 1)) });
  const mean = (picture) => picture.data.reduce((all, each, i) => (i % 4 ? all : all + each), 0) * 4 / picture.data.length;
  function supporting() { // the limitation chosen; else those that were found; else all
    const picked = [chosen("a"), chosen("b")].filter((each) => each.kind === "limitation");
    if (picked.length) return picked;
    const all = exhibit.pictures.filter((each) => each.kind === "limitation");
    const found = all.filter((each) => (render()?.findings ?? []).some((one) => one.name === each.model));
    return found.length ? found : all;
  }
  async function support(acting) {
    const reference = await load(exhibit.pictures[0].file);
    const values = new Float32Array(a.width * a.height);
    for (const each of acting) {
      const { data } = await load(each.file);
      for (let i = 0; i < data.length; i++) {
        if (i % 4 < 3 && Math.abs(data[i] - reference.data[i]) > TOLERANCE * Math.abs(reference.data[i]) + 5e-4) values[i >> 2] = 1;
      }
    }
    return values;
  }

  // --- what is said ----------------------------------------------------------------------------------------------
  const element = (tag, text = "", name = "") => { const made = document.createElement(tag); made.textContent = text; if (name) made.className = name; return made; };
  const GLYPHS = { pass: "✓", limitation: "≈", bug: "✗", inconclusive: "?", unsupported: "–", error: "!" };
  function status(text) { $("status").textContent = text; $("status").hidden = !text; }
  function describe() {
    const told = render(), panel = $("verdict");
    panel.replaceChildren();
    if (!told) return;
    const title = element("h2", told.renderer);
    const badge = element("span", "", `badge ${told.verdict}`);
    badge.textContent = `${GLYPHS[told.verdict] ?? ""} ${told.verdict}`;
    title.append(" ", badge);
    panel.append(title, element("p", told.message), findings());
    const facts = [told.renderer_version, told.run && `run ${told.run}`, told.seconds?.render && `${told.seconds.render.toFixed(2)} s`, told.expected && `expected ${told.expected}`];
    panel.append(element("p", facts.filter(Boolean).join(" · "), "quiet"), element("code", told.command, "command"));
  }
  function findings() {
    const list = element("ol", "", "findings");
    boxes().forEach((each, index) => {
      const again = index && boxes()[index - 1].name === each.name;
      const button = element("button", again ? `also at ${each.box[0]}, ${each.box[1]}` : `${each.name.replaceAll("_", " ")} (${each.kind})`);
      button.type = "button";
      button.addEventListener("click", () => go(index));
      const item = element("li", "", each.kind);
      item.append(button, element("span", again ? "" : ` ${Math.round(each.area_px ?? 0)} px, jnd ${Number((each.jnd ?? 0).toPrecision(2))}`, "quiet"));
      list.append(item);
    });
    return list;
  }
  function row(name, values, note = "") {
    const made = element("tr");
    const head = element("th", name);
    head.scope = "row";
    if (note) head.append(element("small", note));
    made.append(head, ...[...values].slice(0, 3).map((value) => element("td", String(value))));
    return made;
  }
  function point() {
    $("at").textContent = at ? `${at[0]}, ${at[1]}` : "–";
    $("values").replaceChildren();
    if (!at || !a) return;
    const [p, q] = [value_of(a, ...at), value_of(b, ...at)];
    $("values").append(row("A", p), row("B", q), row("B − A", [0, 1, 2].map((c) => Number((q[c] - p[c]).toPrecision(6)))));
    if (map) $("values").append(row(state.of, [Number(value_of(map, ...at)[0].toPrecision(6))]));
    if (kept) { modelsThere(); termsThere(); }
    $("models-at").hidden = $("terms-at").hidden = !kept;
  }
  async function modelsThere() {
    const [x, y] = at, seen = exhibit;
    const acting = exhibit.pictures.filter((each) => ["reference", "limitation", "convention"].includes(each.kind));
    const loaded = await Promise.all(acting.map((each) => load(each.file)));
    if (seen !== exhibit || !at || at[0] !== x || at[1] !== y) return;
    $("models").replaceChildren(...acting.map((each, i) => row(each.title, value_of(loaded[i], x, y), each.kind === "reference" ? "" : each.kind)));
  }
  async function termsThere() {
    const [x, y] = at, seen = exhibit;
    if (!exhibit.terms) { $("terms-at").hidden = true; return; }
    terms ??= await load(exhibit.terms);
    if (seen !== exhibit || !at || at[0] !== x || at[1] !== y) return;
    const { step, columns, names, points } = terms;
    const column = Math.min(columns - 1, Math.floor(x / step)), line = Math.min(points.length / columns - 1, Math.floor(y / step));
    const told = points[line * columns + column];
    const list = [["probed at", `${column * step + (step >> 1)}, ${line * step + (step >> 1)}`]];
    const vector = (values) => values.join(", ");
    if (!told) list.push(["sees", "background"]);
    else {
      const [object, face, depth, normal, facet, cosine, u, v, albedo, lights] = told;
      list.push(["sees", names[object] + (face < 0 ? "" : `, face ${face}`)], ["depth", depth], ["N′", vector(normal)], ["N", vector(facet)], ["N′·V", cosine], ["u, v", `${u}, ${v}`], ["albedo", vector(albedo)]);
      for (const [light, shading, geometric, distance, blocker, share, forgiven] of lights) {
        const shadow = shading <= 0 ? "none: N′·L ≤ 0" : !blocker ? "free" : forgiven ? `meets ${names[blocker]}: forgiven, its own facets` : `meets ${names[blocker]}: ${share} gets through`;
        list.push([`${names[light]}: N′·L`, shading], ["N·L", geometric], ["distance", distance ?? "∞"], ["shadow ray", shadow]);
      }
    }
    $("terms").replaceChildren(...list.flatMap(([key, value]) => [element("dt", key), element("dd", String(value))]));
  }
  function refresh() {
    for (const each of document.querySelectorAll("[data-mode]")) each.setAttribute("aria-pressed", each.dataset.mode === state.mode);
    for (const each of document.querySelectorAll("[data-only]")) each.hidden = each.dataset.only !== state.mode;
    $("measure").value = state.of; $("exposure").value = state.ev; $("stops").textContent = `${state.ev > 0 ? "+" : ""}${state.ev}`;
    $("tone").value = state.tone; $("channels").value = state.ch; $("wipe").value = state.wipe;
    $("boxes").setAttribute("aria-pressed", state.boxes);
    const both = state.mode === "side" || state.mode === "wipe";
    const title = (slot) => `${slot.toUpperCase()} ${chosen(slot)?.title ?? ""}`;
    $("tag-a").textContent = state.mode === "difference" ? `${title("a")} against ${title("b")}` : state.mode === "blink" && state.second ? title("b") : title("a");
    $("tag-b").textContent = both ? title("b") : "";
    canvas.setAttribute("aria-label", `${state.mode}: ${title("a")}, ${title("b")}`);
    draw();
    point();
    toAddress();
  }

  // --- the address -----------------------------------------------------------------------------------------------
  function toAddress() {
    if (!exhibit) return;
    const said = { scene: exhibit.scene, variant: exhibit.variant, a: $("a").value, b: $("b").value, mode: state.mode };
    if (state.mode === "difference") said.of = state.of;
    if (state.ev) said.ev = state.ev;
    if (state.tone !== "srgb") said.tone = state.tone;
    if (state.ch !== "C") said.ch = state.ch;
    if (kept && at) said.at = at.join();
    if (view.moved) said.view = [view.zoom, view.x, view.y].map((each) => Number(each.toPrecision(9))).join();
    history.replaceState(null, "", `#${new URLSearchParams(said)}`);
  }
  function fromAddress() {
    const said = Object.fromEntries(new URLSearchParams(location.hash.slice(1)));
    const pick = (value, known, otherwise) => (known.includes(value) ? value : otherwise);
    state.mode = pick(said.mode, MODES, "side"); state.of = pick(said.of, MEASURES, state.of);
    state.tone = pick(said.tone, TONES, "srgb"); state.ch = pick(said.ch, CHANNELS, "C");
    state.ev = Math.min(10, Math.max(-10, Number(said.ev) || 0));
    const numbers = (text, count) => { const found = (text ?? "").split(",").map(Number); return found.length === count && found.every(Number.isFinite) ? found : null; };
    const pixel = numbers(said.at, 2), seen = numbers(said.view, 3);
    const at = pixel?.every((each) => Number.isInteger(each) && each >= 0) ? pixel : null;
    const found = scenes.find(([scene, variant]) => scene === said.scene && (said.variant === undefined || variant === said.variant)) ?? scenes[0];
    view.moved = Boolean(seen && seen[0] > 0);
    if (!found) { status("This gallery holds no scene."); return; }
    $("scene").value = found[2];
    open(found[2], { a: said.a, b: said.b, at, ...(view.moved ? { zoom: seen[0], cx: seen[1], cy: seen[2] } : {}) }).catch((error) => status(error.message));
  }
  function start() {
    if (!gl) { status("This browser shows no WebGL2, which float pictures need."); return; }
    fromAddress();
    addEventListener("hashchange", fromAddress);
  }

  // --- moving ----------------------------------------------------------------------------------------------------
  function fit(moved = true) {
    Object.assign(view, { x: a.width / 2, y: a.height / 2, zoom: Math.min(pane() / a.width, tall() / a.height), moved: false });
    if (moved) refresh();
  }
  function zoomBy(factor, x = pane() / 2, y = tall() / 2) { // the image point under (x, y) stays there
    const zoom = Math.min(400, Math.max(0.1, view.zoom * factor));
    const [x0, y0] = origin();
    const [px, py] = [(x - x0) / view.zoom, (y - y0) / view.zoom];
    Object.assign(view, { zoom, x: px - (x - pane() / 2) / zoom, y: py - (y - tall() / 2) / zoom, moved: true });
    refresh();
  }
  function go(index) {
    const all = boxes();
    if (!all.length) return;
    finding = (index + all.length) % all.length;
    const [x0, y0, x1, y1] = all[finding].box;
    const zoom = 0.6 * Math.min(pane() / (x1 - x0), tall() / (y1 - y0));
    Object.assign(view, { x: (x0 + x1) / 2, y: (y0 + y1) / 2, zoom: Math.min(64, Math.max(zoom, 0.1)), moved: true });
    [...document.querySelectorAll(".findings li")].forEach((each, i) => each.toggleAttribute("data-current", i === finding));
    refresh();
  }
  function place(event) { // device pixels inside of the pane
    const box = canvas.getBoundingClientRect(), scale = canvas.width / box.width;
    return [((event.clientX - box.left) * scale) % pane(), ((event.clientY - box.top) * scale) % tall()];
  }
  function pixel(event) {
    const [x, y] = place(event), [x0, y0] = origin();
    const found = [Math.floor((x - x0) / view.zoom), Math.floor((y - y0) / view.zoom)];
    return found[0] >= 0 && found[1] >= 0 && found[0] < a.width && found[1] < a.height ? found : null;
  }
  const pointers = new Map();
  let travelled = 0;
  canvas.addEventListener("pointerdown", (event) => { canvas.setPointerCapture(event.pointerId); pointers.set(event.pointerId, event); travelled = 0; });
  canvas.addEventListener("pointermove", (event) => {
    if (!a) return;
    const before = pointers.get(event.pointerId);
    if (!before) { if (!kept) { at = pixel(event); draw(); point(); } return; }
    const scale = canvas.width / canvas.getBoundingClientRect().width;
    const [dx, dy] = [event.clientX - before.clientX, event.clientY - before.clientY];
    travelled += Math.abs(dx) + Math.abs(dy);
    if (pointers.size === 2) {
      const [other] = [...pointers].filter(([id]) => id !== event.pointerId).map(([, each]) => each);
      const apart = (p) => Math.hypot(p.clientX - other.clientX, p.clientY - other.clientY) || 1;
      pointers.set(event.pointerId, event);
      zoomBy(apart(event) / apart(before), ...place({ clientX: (event.clientX + other.clientX) / 2, clientY: (event.clientY + other.clientY) / 2 }));
    } else if (state.mode === "wipe" && Math.abs(place(before)[0] - canvas.width * state.wipe) < 16 * scale) {
      pointers.set(event.pointerId, event);
      state.wipe = Math.min(1, Math.max(0, place(event)[0] / canvas.width));
      refresh();
    } else {
      pointers.set(event.pointerId, event);
      Object.assign(view, { x: view.x - dx * scale / view.zoom, y: view.y - dy * scale / view.zoom, moved: true });
      refresh();
    }
  });
  canvas.addEventListener("pointerup", (event) => {
    pointers.delete(event.pointerId);
    if (travelled > 4 || !a) return;
    const found = pixel(event);
    kept = Boolean(found) && !(kept && at && found.join() === at.join());
    at = found;
    refresh();
  });
  canvas.addEventListener("pointercancel", (event) => pointers.delete(event.pointerId));
  canvas.addEventListener("wheel", (event) => { event.preventDefault(); if (a) zoomBy(2 ** (-event.deltaY / 200), ...place(event)); }, { passive: false });

  // --- controls --------------------------------------------------------------------------------------------------
  const set = (change) => { Object.assign(state, change); measure(); };
  $("scene").addEventListener("change", () => { view.moved = false; open($("scene").value).catch((error) => status(error.message)); });
  for (const slot of ["a", "b"]) $(slot).addEventListener("change", () => { finding = -1; choose(); });
  for (const each of document.querySelectorAll("[data-mode]")) each.addEventListener("click", () => mode(each.dataset.mode));
  $("measure").addEventListener("change", () => set({ of: $("measure").value }));
  $("exposure").addEventListener("input", () => { state.ev = Number($("exposure").value); refresh(); });
  $("tone").addEventListener("change", () => { state.tone = $("tone").value; refresh(); });
  $("channels").addEventListener("change", () => { state.ch = $("channels").value; refresh(); });
  $("wipe").addEventListener("input", () => { state.wipe = Number($("wipe").value); refresh(); });
  $("fit").addEventListener("click", () => a && fit());
  $("one").addEventListener("click", () => a && zoomBy((devicePixelRatio || 1) / view.zoom));
  $("in").addEventListener("click", () => a && zoomBy(2));
  $("out").addEventListener("click", () => a && zoomBy(0.5));
  $("boxes").addEventListener("click", () => { state.boxes = !state.boxes; refresh(); });
  $("help").addEventListener("click", () => $("keys").showModal());
  new ResizeObserver(() => { if (!view.moved) view.zoom = 0; draw(); }).observe(stage);

  function mode(next) {
    const resized = (next === "side") !== (state.mode === "side");
    if (next === "blink") state.second = state.mode === "blink" ? !state.second : true;
    else state.second = false;
    state.mode = next;
    if (resized && !view.moved) view.zoom = 0;
    measure();
  }
  function step(dx, dy) {
    at = at ? [Math.min(a.width - 1, Math.max(0, at[0] + dx)), Math.min(a.height - 1, Math.max(0, at[1] + dy))] : [a.width >> 1, a.height >> 1];
    kept = true;
    refresh();
  }
  const KEYS = {
    "[": () => { state.ev = Math.max(-10, state.ev - 0.5); refresh(); },
    "]": () => { state.ev = Math.min(10, state.ev + 0.5); refresh(); },
    " ": () => mode("blink"), w: () => mode("wipe"), s: () => mode("side"),
    d: () => { if (state.mode === "difference") state.of = MEASURES[(MEASURES.indexOf(state.of) + 1) % MEASURES.length]; mode("difference"); },
    f: () => fit(), "+": () => zoomBy(2), "=": () => zoomBy(2), "-": () => zoomBy(0.5), 1: () => $("one").click(),
    j: () => go(finding + 1), k: () => go(finding < 0 ? -1 : finding - 1),
    x: () => { [$("a").value, $("b").value] = [$("b").value, $("a").value]; choose(); },
    "?": () => $("keys").showModal(),
  };
  for (const each of CHANNELS) KEYS[each.toLowerCase()] = () => { state.ch = each; refresh(); };
  const ARROWS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };
  document.addEventListener("keydown", (event) => {
    const { target } = event;
    if (!a || event.ctrlKey || event.metaKey || event.altKey || $("keys").open || target.tagName === "SELECT") return;
    if (target.tagName === "BUTTON" && event.key === " ") return;
    const arrow = ARROWS[event.key];
    if (arrow && target === canvas) step(...arrow.map((each) => each * (event.shiftKey ? 10 : 1)));
    else if (KEYS[event.key.toLowerCase()]) KEYS[event.key.toLowerCase()]();
    else return;
    event.preventDefault();
  });
})();
