"use strict";
var viewer, viewers = [];

async function inflate(line) {
  const packed = Uint8Array.from(atob(line), c => c.charCodeAt(0));
  const plain = new Blob([packed]).stream().pipeThrough(new DecompressionStream("gzip"));
  return new Uint8Array(await new Response(plain).arrayBuffer());
}

function shade(root) {
  root.traverse(object => {
    if (object.isMesh && !object.geometry.attributes.normal) object.geometry.computeVertexNormals();
  });
}

function arrangeControls(viewer) {
  const scene = viewer.scene_tree.find(["meshcat"]);
  const root = scene.find(["<object>"]).object;
  root.children.forEach(child => scene.add_child(child));
  viewer.gui.__folders["Scene"].close();
  viewer.gui.open();
}

// Panes are narrow: at their top controls would cover the title.
function moveDown(gui) {
  gui.close();
  Object.assign(gui.domElement.style, {top: "auto", bottom: "20px"});  // its button hangs below it
}

function showTime() {
  viewers.slice(1).forEach(follow);
  viewers.forEach((each, k) => {
    document.querySelectorAll(".time")[k].textContent = `t = ${each.animator.time.toFixed(2)} s`;
  });
  requestAnimationFrame(showTime);
}

// A pane that is narrower than the camera was placed for shows everything smaller, and nothing less.
function fit(shown, pane) {
  shown.camera.zoom = Math.min(1, pane.offsetWidth / pane.offsetHeight / Number(pane.dataset.aspect));
  shown.set_dirty();
}

// The time of all scenes is that of the first, whose controls are the only ones.
function follow(other) {
  other.animator.pause();
  other.animator.seek(viewer.animator.time);
  other.animator.display_progress(viewer.animator.time);
  other.render();
}

// Who turns or moves one scene turns and moves all.
function seeTogether() {
  viewers.forEach(one => one.controls.addEventListener("change", () => viewers.forEach(other => {
    if (other === one) return;
    other.camera.position.copy(one.camera.position);
    other.controls.target.copy(one.controls.target);
    other.set_dirty();
  })));
}

async function show(view) {
  const lines = view.querySelector(".commands").textContent.trim().split("\n");
  const commands = await Promise.all(lines.map(inflate));
  const pane = view.querySelector(".pane");
  const shown = new MeshCat.Viewer(pane);
  viewers.push(shown);
  viewer = viewers[0];
  shown.controls.target.fromArray(JSON.parse(pane.dataset.target));
  commands.forEach(command => shown.handle_command_bytearray(command));
  shade(shown.scene);
  arrangeControls(shown);
  if (viewers.length > 1) shown.gui.hide();
  if (document.querySelectorAll(".view").length > 1) moveDown(shown.gui);
  fit(shown, pane);
  addEventListener("resize", () => fit(shown, pane));
}

async function start() {
  for (const view of document.querySelectorAll(".view")) await show(view);
  seeTogether();
  if (viewer.animator.duration > 0) showTime();
}

start().catch(error => {
  document.querySelector(".failure").textContent = `This scene cannot be shown: ${error.message}`;
  throw error;
});
