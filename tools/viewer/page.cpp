// SPDX-License-Identifier: Apache-2.0
#include "page.hpp"

namespace gsnav_viewer {
namespace {

constexpr std::string_view kPage = R"html(<!doctype html>
<html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width">
<title>gsnav viewer</title><link rel="icon" href="data:,"><style>
:root{color-scheme:dark;--line:#30343c;--dim:#9aa3b2}
*{box-sizing:border-box}
body{margin:0;background:#14161a;color:#e8eaee;font:14px/1.4 system-ui,sans-serif}
header{display:flex;gap:1em;align-items:baseline;padding:.7em 1.2em;border-bottom:1px solid var(--line)}
h1{font-size:1rem;margin:0}header span,figcaption,dt,kbd{color:var(--dim)}#speed{margin-left:auto}
main{padding:1em 1.2em;max-width:140em;margin:auto}
#panels{display:flex;flex-wrap:wrap;gap:1em}
figure{margin:0;min-width:0}figure img{display:block;max-width:100%;background:#000;border-radius:6px}
#color{cursor:grab;touch-action:none}#color:active{cursor:grabbing}
figcaption{padding:.3em 0}
#bar{display:flex;flex-wrap:wrap;gap:.6em 1.2em;align-items:center;margin:.6em 0 1em}
#bar input[type=range]{flex:1;min-width:12em}
button{background:#262a32;color:inherit;border:1px solid var(--line);border-radius:6px;padding:.3em .9em;font:inherit;cursor:pointer}
button:hover{background:#323844}
dl{display:grid;grid-template-columns:repeat(auto-fill,minmax(9.5em,1fr));gap:.5em;margin:0}
dl div{border:1px solid var(--line);border-radius:6px;padding:.4em .7em}dt{font-size:.85em}
dd{margin:0;font-variant-numeric:tabular-nums;font-size:1.15em}
kbd{border:1px solid var(--line);border-radius:4px;padding:0 .35em;font:inherit}
p{color:var(--dim);margin:1em 0 0}output{font-variant-numeric:tabular-nums}
</style></head><body>
<header><h1>gsnav</h1><span id="scene"></span><span id="episode"></span><span id="speed"></span></header>
<main><div id="panels">
<figure><img id="color" src="/stream/color" alt="what the agent sees" draggable="false"><figcaption>colour</figcaption></figure>
<figure><img src="/stream/depth" alt="depth"><figcaption>depth: bright is near</figcaption></figure>
<figure><img src="/stream/map" alt="map"><figcaption>map: dark line, the shortest way; ring, the goal</figcaption></figure>
</div>
<div id="bar"><button id="paused">pause</button>
<input id="time" type="range" min="0" max="120" step="0.05" aria-label="time"><output id="clock"></output>
<label><input type="checkbox" id="people" checked> people</label>
<label><input type="checkbox" id="capsules"> capsules</label>
<label><input type="checkbox" id="navmesh"> NavMesh</label>
<button id="stop">stop here</button><button id="next">next episode</button></div>
<dl id="metrics"></dl>
<p><kbd>W</kbd> <kbd>A</kbd> <kbd>S</kbd> <kbd>D</kbd> walk, drag the picture or <kbd>&larr;</kbd> <kbd>&rarr;</kbd> <kbd>&uarr;</kbd>
<kbd>&darr;</kbd> look, <kbd>space</kbd> pause, <kbd>P</kbd> people, <kbd>C</kbd> capsules, <kbd>M</kbd> NavMesh, <kbd>N</kbd> next episode.</p>
</main><script>
"use strict";
const $ = id => document.getElementById(id);
const held = new Set(), once = {};
let turn = 0, tilt = 0, scrubbing = false, busy = false, wasMoving = false, paused = null;
const number = (v, digits, unit) => v === null || v === undefined ? "none" : v.toFixed(digits) + unit;
function show(s) {
  $("scene").textContent = s.scene;
  const how = s.done ? (s.success ? ": reached" : ": stopped away from the goal") : "";
  $("episode").textContent = "episode " + s.episode + " of " + s.episodes + how;
  $("speed").textContent = number(s.rate, 1, " frames/s, ") + number(s.frame_ms, 1, " ms a frame, ") +
    s.visible.toLocaleString("en") + " Gaussians in view";
  paused = s.paused;
  $("paused").textContent = s.paused ? "play" : "pause";
  if (s.time > +$("time").max) $("time").max = Math.ceil(s.time / 60) * 60 + 60;
  if (!scrubbing) $("time").value = s.time;
  $("clock").textContent = s.time.toFixed(1) + " s";
  const m = s.metrics, cards = [
    ["distance to goal", number(m.distance_to_goal, 2, " m")], ["path", number(m.path_length, 2, " m")],
    ["shortest way", number(m.shortest_path, 2, " m")], ["SPL", number(m.spl, 3, "")],
    ["SoftSPL", number(m.soft_spl, 3, "")], ["nearest person", number(m.clearance, 2, " m")],
    ["collision rate (CR)", number(m.collision_rate, 3, "")], ["intrusion (PSI)", number(m.psi, 3, "")],
    ["wall collisions", number(m.collisions, 0, "")], ["actions", number(m.steps, 0, "")]];
  $("metrics").replaceChildren(...cards.map(([name, value]) => {
    const card = document.createElement("div"), dt = document.createElement("dt"), dd = document.createElement("dd");
    dt.textContent = name; dd.textContent = value; card.append(dt, dd); return card;
  }));
}
async function tell() {
  if (busy) return;
  const axis = (a, b) => (held.has(a) ? 1 : 0) - (held.has(b) ? 1 : 0);
  const forward = axis("KeyW", "KeyS"), left = axis("KeyA", "KeyD");
  turn += 0.06 * axis("ArrowLeft", "ArrowRight"); tilt += 0.04 * axis("ArrowUp", "ArrowDown");
  const fields = {...once};
  const moving = forward !== 0 || left !== 0;
  if (moving || wasMoving) Object.assign(fields, {forward, left});
  if (turn !== 0) fields.turn = turn.toFixed(5);
  if (tilt !== 0) fields.tilt = tilt.toFixed(5);
  wasMoving = moving; turn = tilt = 0;
  for (const k in once) delete once[k];
  busy = true;
  try {
    const r = await fetch("/control", {method: "POST", body: Object.entries(fields).map(e => e.join("=")).join("&")});
    if (r.ok) { const s = await r.json(); if (s.metrics) show(s); }
  } catch (e) { $("speed").textContent = "the viewer does not answer"; }
  busy = false;
}
let ticks = 0;
setInterval(() => {
  if (held.size || turn || tilt || Object.keys(once).length || wasMoving || ++ticks % 5 === 0) tell();
}, 50);
const flip = id => { $(id).checked = !$(id).checked; once[id] = +$(id).checked; };
for (const id of ["people", "capsules", "navmesh"]) $(id).onchange = () => { once[id] = +$(id).checked; };
const pause = () => { once.paused = paused ? 0 : 1; };
$("paused").onclick = pause;
$("stop").onclick = () => { once.stop = 1; };
$("next").onclick = () => { once.next = 1; };
$("time").oninput = () => { scrubbing = true; once.time = $("time").value; once.paused = 1; };
$("time").onchange = () => { scrubbing = false; };
const walks = ["KeyW", "KeyA", "KeyS", "KeyD", "ArrowLeft", "ArrowRight", "ArrowUp", "ArrowDown"];
addEventListener("keydown", e => {
  if (e.ctrlKey || e.metaKey || e.altKey) return;
  if (walks.includes(e.code)) { held.add(e.code); e.preventDefault(); return; }
  if (e.repeat) return;
  if (e.code === "Space") { pause(); e.preventDefault(); }
  if (e.code === "KeyP") flip("people");
  if (e.code === "KeyC") flip("capsules");
  if (e.code === "KeyM") flip("navmesh");
  if (e.code === "KeyN") once.next = 1;
});
addEventListener("keyup", e => held.delete(e.code));
addEventListener("blur", () => held.clear());
const view = $("color");
view.onpointerdown = e => view.setPointerCapture(e.pointerId);
view.onpointermove = e => {
  if (!view.hasPointerCapture(e.pointerId)) return;
  turn += e.movementX * 1.6 / view.clientWidth; tilt += e.movementY * 1.6 / view.clientWidth;
};
tell();
</script></body></html>
)html";

}  // namespace

std::string_view page() noexcept { return kPage; }

}  // namespace gsnav_viewer
