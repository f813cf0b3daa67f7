// SPDX-License-Identifier: Apache-2.0
#include "page.hpp"

namespace gsnav_viewer {
namespace {

constexpr std::string_view kPage = R"html(<!doctype html>
<html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width,initial-scale=1">
<title>gsnav viewer</title><link rel="icon" href="data:,"><style>
:root{color-scheme:dark;--line:#30343c;--dim:#9aa3b2;--gap:12px}
*{box-sizing:border-box}
body{margin:0;background:#14161a;color:#e8eaee;font:14px/1.35 system-ui,sans-serif}
header{display:flex;flex-wrap:wrap;gap:0 1em;align-items:baseline;padding:.5em var(--gap);
  border-bottom:1px solid var(--line)}
h1{font-size:1rem;margin:0}header span,figcaption,dt,kbd,#help{color:var(--dim)}#speed{margin-left:auto}
main{padding:var(--gap);max-width:140em;margin:auto}
#panels{display:grid;grid-template-columns:repeat(3,minmax(0,max-content));gap:var(--gap);justify-content:center}
figure{margin:0;min-width:0;position:relative}canvas{display:block;max-width:100%;background:#000;border-radius:6px}
#color{cursor:grab;touch-action:none}#color:active{cursor:grabbing}
figcaption{display:flex;gap:.6em;align-items:center;padding:.25em 0;min-height:1.9em}
#scale{flex:1;height:.7em;border-radius:3px;min-width:3em}
#news{position:absolute;left:8px;right:8px;top:8px;padding:.5em .8em;border-radius:6px;
  background:#000c;text-align:center}
#news:empty{display:none}
#bar{display:flex;flex-wrap:wrap;gap:.4em .9em;align-items:center;margin:.4em 0 .7em}
#bar input[type=range]{flex:1 1 12em;min-width:8em}
button{background:#262a32;color:inherit;border:1px solid var(--line);border-radius:6px;
  padding:.3em .9em;font:inherit;cursor:pointer}
button:hover{background:#323844}:focus-visible{outline:2px solid #7aa7ff;outline-offset:2px}
dl{display:grid;grid-template-columns:repeat(auto-fit,minmax(7.6em,1fr));gap:.4em;margin:0}
dl div{border:1px solid var(--line);border-radius:6px;padding:.25em .6em}dt{font-size:.85em}
dd{margin:0;font-variant-numeric:tabular-nums;font-size:1.1em}
kbd{border:1px solid var(--line);border-radius:4px;padding:0 .35em;font:inherit}
#help{margin:.7em 0 0}output{font-variant-numeric:tabular-nums;min-width:4em}
#pad{display:none;grid-template-columns:repeat(3,3.4em);grid-auto-rows:3em;gap:.35em;
  user-select:none;-webkit-user-select:none}
#pad button{touch-action:none;padding:0;font-size:1.2em}
@media (pointer:coarse),(max-width:700px){#pad{display:grid}#help{display:none}}
@media (max-width:700px){
  :root{--gap:8px}
  #panels{grid-template-columns:repeat(2,minmax(0,1fr))}figure:first-child{grid-column:1/-1}canvas{width:100%}
  #speed{margin-left:0;font-size:.85em}dl{grid-template-columns:repeat(auto-fit,minmax(7em,1fr))}
  button{padding:.45em .8em}
}
</style></head><body>
<header><h1>gsnav</h1><span id="scene"></span><span id="episode"></span><span id="speed"></span></header>
<main><div id="panels">
<figure><canvas id="color" role="img" aria-label="what the agent sees"></canvas><div id="news" role="status"></div>
<figcaption>colour: drag to look</figcaption></figure>
<figure><canvas id="depth" role="img" aria-label="depth"></canvas>
<figcaption>depth <span id="near"></span><span id="scale"></span><span id="far"></span></figcaption></figure>
<figure><canvas id="map" role="img" aria-label="map"></canvas>
<figcaption>map: dark line, the shortest way; ring, the goal</figcaption></figure>
</div>
<div id="bar">
<div id="pad"><span></span><button data-key="KeyW" aria-label="walk forward">&#9650;</button><span></span>
<button data-key="KeyA" aria-label="step to the left">&#9664;</button><button
 data-key="KeyS" aria-label="walk back">&#9660;</button>
<button data-key="KeyD" aria-label="step to the right">&#9654;</button></div>
<button id="paused" aria-keyshortcuts="Space">pause</button>
<input id="time" type="range" min="0" max="120" step="0.05"
 aria-label="time, seconds"><output id="clock" for="time"></output>
<label><input type="checkbox" id="people" aria-keyshortcuts="P" checked> people</label>
<label><input type="checkbox" id="capsules" aria-keyshortcuts="C"> capsules</label>
<label><input type="checkbox" id="navmesh" aria-keyshortcuts="M"> NavMesh</label>
<button id="stop" aria-keyshortcuts="X">stop here</button><button
 id="next" aria-keyshortcuts="N">next episode</button></div>
<dl id="metrics"></dl>
<p id="help"><kbd>W</kbd> <kbd>A</kbd> <kbd>S</kbd> <kbd>D</kbd>
walk, drag or <kbd>&larr;</kbd> <kbd>&rarr;</kbd> <kbd>&uarr;</kbd>
<kbd>&darr;</kbd> look, <kbd>space</kbd> pause, <kbd>,</kbd> <kbd>.</kbd> time,
<kbd>P</kbd> people, <kbd>C</kbd> capsules,
<kbd>M</kbd> NavMesh, <kbd>X</kbd> stop here, <kbd>N</kbd> next episode.</p>
</main><script>
"use strict";
const $ = id => document.getElementById(id);
const panels = ["color", "depth", "map"];
const held = new Set(), once = {};
const boxes = ["people", "capsules", "navmesh"];
let turn = 0, tilt = 0, scrubbing = false, wasMoving = false, state = null, seen = null, request = null, before = 0;
const number = (v, digits, unit) => v === null || v === undefined ? "none" : v.toFixed(digits) + unit;
function say(id, text) { if ($(id).textContent !== text) $(id).textContent = text; }
function show(s) {
  state = s;
  say("scene", s.scene);
  say("episode", "episode " + s.episode + " of " + s.episodes);
  say("news", !s.done ? "" : (s.success ? "Reached the goal." : "Stopped away from the goal.") +
      " N or \u201cnext episode\u201d begins the next one.");
  say("speed", number(s.rate, 1, " frames/s, ") + number(s.frame_ms, 1, " ms per frame, ") +
      s.visible.toLocaleString("en") + " Gaussians in view");
  say("paused", s.paused ? "play" : "pause");
  for (const id of boxes) { if (!(id in once)) $(id).checked = s[id]; }  // another tab may have changed them
  say("near", s.depth.near + " m"); say("far", s.depth.far + " m");
  $("scale").style.background = "linear-gradient(to right," + s.depth.colors.join() + ")";
  if (s.time > +$("time").max) $("time").max = Math.ceil(s.time / 60) * 60 + 60;
  if (!scrubbing) $("time").value = s.time;
  say("clock", s.time.toFixed(1) + " s");
  const m = s.metrics, cards = [
    ["distance to goal", number(m.distance_to_goal, 2, " m")], ["path", number(m.path_length, 2, " m")],
    ["shortest way", number(m.shortest_path, 2, " m")], ["SPL", number(m.spl, 3, "")],
    ["SoftSPL", number(m.soft_spl, 3, "")], ["nearest person", number(m.clearance, 2, " m")],
    ["collisions (CR)", number(m.collision_rate, 3, "")], ["intrusion (PSI)", number(m.psi, 3, "")],
    ["compliance (PSC)", number(m.psc, 3, "")],
    ["wall collisions", number(m.collisions, 0, "")], ["actions", number(m.steps, 0, "")]];
  $("metrics").replaceChildren(...cards.map(([name, value]) => {
    const card = document.createElement("div"), dt = document.createElement("dt"), dd = document.createElement("dd");
    dt.textContent = name; dd.textContent = value; card.append(dt, dd); return card;
  }));
}
async function draw(id, bytes) {
  const image = await createImageBitmap(new Blob([bytes], {type: "image/jpeg"})), to = $(id);
  if (to.width !== image.width || to.height !== image.height) { to.width = image.width; to.height = image.height; }
  to.getContext("2d").drawImage(image, 0, 0);
  image.close();
}
/// Body of the next request: the inputs since the last one. A held arrow key turns the camera by 1.2
/// radians per second, or tilts it by 0.8.
function message() {
  const now = performance.now(), passed = Math.min((now - before) / 1000, 0.2);
  before = now;
  const axis = (a, b) => (held.has(a) ? 1 : 0) - (held.has(b) ? 1 : 0);
  const forward = axis("KeyW", "KeyS"), left = axis("KeyA", "KeyD"), moving = forward !== 0 || left !== 0;
  turn += 1.2 * passed * axis("ArrowLeft", "ArrowRight"); tilt += 0.8 * passed * axis("ArrowUp", "ArrowDown");
  const fields = {...once};
  if (seen !== null) fields.seen = seen;
  if (moving || wasMoving) Object.assign(fields, {forward, left});
  if (turn !== 0) fields.turn = Math.max(-9, Math.min(9, turn)).toFixed(5);
  if (tilt !== 0) fields.tilt = Math.max(-9, Math.min(9, tilt)).toFixed(5);
  wasMoving = moving; turn = tilt = 0;
  for (const k in once) delete once[k];
  return Object.entries(fields).map(e => e.join("=")).join("&");
}
/// Aborts a request that waits for a frame of a paused scene: the next one carries new inputs at once.
function hurry() { if (request && state && state.paused && performance.now() - request.since > 30) request.abort(); }
async function frames() {
  for (;;) {
    if (document.hidden) await new Promise(done => document.addEventListener("visibilitychange", done, {once: true}));
    request = new AbortController();
    request.since = performance.now();
    try {
      const r = await fetch("/frame", {method: "POST", body: message(), signal: request.signal});
      const body = new Uint8Array(await r.arrayBuffer());
      if (!r.ok) throw new Error(new TextDecoder().decode(body));
      const line = body.indexOf(10), s = JSON.parse(new TextDecoder().decode(body.subarray(0, line)));
      if (s.frame > 0 && s.frame !== seen) {
        let at = line + 1;
        const drawn = panels.map((id, k) => draw(id, body.slice(at, at += s.sizes[k])));
        seen = s.frame;
        show(s);
        await Promise.all(drawn);
      }
    } catch (e) {
      if (e.name === "AbortError") continue;
      say("speed", "the viewer does not answer; trying again");
      seen = null;
      await new Promise(done => setTimeout(done, 500));
    }
  }
}
const ask = fields => { Object.assign(once, fields); hurry(); };
const flip = id => { $(id).checked = !$(id).checked; ask({[id]: +$(id).checked}); };
for (const id of boxes) $(id).onchange = () => ask({[id]: +$(id).checked});
const pause = () => ask({paused: state && state.paused ? 0 : 1});
const shift = by => ask({time: Math.max(0, (state ? state.time : 0) + by), paused: 1});
$("paused").onclick = pause;
$("stop").onclick = () => ask({stop: 1});
$("next").onclick = () => ask({next: 1});
$("time").oninput = () => { scrubbing = true; ask({time: $("time").value, paused: 1}); };
$("time").onchange = () => { scrubbing = false; };
const walks = ["KeyW", "KeyA", "KeyS", "KeyD"], looks = ["ArrowLeft", "ArrowRight", "ArrowUp", "ArrowDown"];
const commands = {Space: pause, KeyP: () => flip("people"), KeyC: () => flip("capsules"), KeyM: () => flip("navmesh"),
  KeyX: () => ask({stop: 1}), KeyN: () => ask({next: 1}), Comma: () => shift(-0.5), Period: () => shift(0.5)};
addEventListener("keydown", e => {
  if (e.ctrlKey || e.metaKey || e.altKey) return;
  const on = e.target instanceof Element ? e.target : document.body;  // a control keeps the keys that it has a use for
  if (looks.includes(e.code) && on.matches("input[type=range]")) return;
  if (e.code === "Space" && on.matches("button,input[type=checkbox]")) return;
  if (walks.includes(e.code) || looks.includes(e.code)) { held.add(e.code); hurry(); e.preventDefault(); return; }
  if (commands[e.code] && (!e.repeat || e.code === "Comma" || e.code === "Period")) {
    commands[e.code]();
    e.preventDefault();
  }
});
addEventListener("keyup", e => held.delete(e.code));
addEventListener("blur", () => held.clear());
for (const b of document.querySelectorAll("#pad button")) {
  b.onpointerdown = e => { b.setPointerCapture(e.pointerId); held.add(b.dataset.key); hurry(); e.preventDefault(); };
  b.onlostpointercapture = () => held.delete(b.dataset.key);
  b.oncontextmenu = e => e.preventDefault();
}
const view = $("color");
let last = null;
view.onpointerdown = e => { view.setPointerCapture(e.pointerId); last = [e.clientX, e.clientY]; };
view.onpointermove = e => {
  if (!view.hasPointerCapture(e.pointerId) || !last) return;
  turn += (e.clientX - last[0]) * 1.6 / view.clientWidth; tilt += (e.clientY - last[1]) * 1.6 / view.clientWidth;
  last = [e.clientX, e.clientY];
  hurry();
};
frames();
</script></body></html>
)html";

}  // namespace

std::string_view page() noexcept { return kPage; }

}  // namespace gsnav_viewer
