// Files for the user: bytes, and the picture with its marks.

const PIXELS = 1600; // along the longer side

export function saveText(name, bytes) {
  saveBlob(name, new Blob([bytes]));
}

function saveBlob(name, blob) {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(blob);
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 1000);
}

// What the page's style sheet gives marks, which a picture does not have.
const STYLE = ["display", "fill", "font-weight", "font-family", "stroke", "stroke-opacity", "stroke-linecap"];

// The field smoothly enlarged, and the marks over it.
export async function savePicture({ parts, board, painter }) {
  if (!board || !painter.works) return;
  const [width, height] = board.size_mm, scale = PIXELS / Math.max(width, height);
  const canvas = document.createElement("canvas");
  canvas.width = Math.round(scale * width);
  canvas.height = Math.round(scale * height);
  const context = canvas.getContext("2d"), { canvas: field } = painter;
  context.imageSmoothingQuality = "high";
  // Half a point lies beyond each edge.
  context.drawImage(field, 0.5, 0.5, field.width - 1, field.height - 1, 0, 0, canvas.width, canvas.height);
  context.drawImage(await pictureOf(parts.marks, canvas), 0, 0, canvas.width, canvas.height);
  canvas.toBlob((blob) => saveBlob(`${board.name}.png`, blob));
}

async function pictureOf(svg, { width, height }) {
  const copy = svg.cloneNode(true);
  const ratio = width / svg.clientWidth;
  const shapes = svg.querySelectorAll("path, circle, text");
  copy.querySelectorAll("path, circle, text").forEach((own, k) => {
    const style = getComputedStyle(shapes[k]);
    own.setAttribute("vector-effect", "non-scaling-stroke");
    for (const name of STYLE) own.setAttribute(name, style.getPropertyValue(name));
    own.setAttribute("stroke-width", ratio * parseFloat(style.strokeWidth));
    const dashes = own.getAttribute("stroke-dasharray");
    if (dashes) own.setAttribute("stroke-dasharray", dashes.split(" ").map((length) => ratio * length).join(" "));
  });
  copy.setAttribute("width", width);
  copy.setAttribute("height", height);
  const image = new Image();
  image.src = `data:image/svg+xml,${encodeURIComponent(new XMLSerializer().serializeToString(copy))}`;
  await image.decode();
  return image;
}
