"use strict";
var viewer;

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

function arrangeControls() {
  const scene = viewer.scene_tree.find(["meshcat"]);
  const root = scene.find(["<object>"]).object;
  root.children.forEach(child => scene.add_child(child));
  viewer.gui.__folders["Scene"].close();
  viewer.gui.open();
}

function showTime() {
  document.getElementById("time").textContent = `t = ${viewer.animator.time.toFixed(2)} s`;
  requestAnimationFrame(showTime);
}

async function start() {
  const lines = document.getElementById("commands").textContent.trim().split("\n");
  const commands = await Promise.all(lines.map(inflate));
  const pane = document.getElementById("meshcat-pane");
  viewer = new MeshCat.Viewer(pane);
  viewer.controls.target.fromArray(JSON.parse(pane.dataset.target));
  commands.forEach(command => viewer.handle_command_bytearray(command));
  shade(viewer.scene);
  arrangeControls();
  if (viewer.animator.duration > 0) showTime();
}

start().catch(error => {
  document.getElementById("failure").textContent = `This scene cannot be shown: ${error.message}`;
  throw error;
});
