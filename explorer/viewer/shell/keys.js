// An arrow key on a slider moves that slider, and neither the pour nor the camera: what listens for keys on the whole
// document (viser's commands, its camera) does not hear of it.
document.getElementById("root").addEventListener("keydown", event => {
  if (event.key.startsWith("Arrow") && event.target.closest("[role=slider]")) event.stopPropagation();
});
