// What the parts of this page share.
const { columns, pictures } = data;
/** What was held against a photograph stands for itself. */
const elevations = data.elevations.filter((entry) => !entry.photographed);
const photographed = data.elevations.filter((entry) => entry.photographed);
const { views, suns } = data.identity.plan;
const heights = [...new Set(data.identity.plan.heights_px)].sort((a, b) => b - a);
const elevationsDeg = [...new Set(views.map((view) => view.elevation_deg))].sort((a, b) => a - b);
const compared = data.methods.filter((run) => run.rows.length > 0);
const rows = compared.flatMap((run) => run.rows);

const costs = {
  ms: { name: "Milliseconds for one tree", short: "milliseconds", of: (cost) => cost.ms, show: (value) => `${digits(value)} ms` },
  bytes: { name: "Bytes of textures and geometry", short: "bytes", of: (cost) => cost.texture_bytes + cost.geometry_bytes, show: bytes },
  triangles: { name: "Triangles", short: "triangles", of: (cost) => cost.triangles, show: (value) => `${whole(value)} triangles` },
};

const errorOf = (error, id) => (number(error?.[id]) ? Math.abs(error[id]) : NaN);
const columnOf = (id) => columns.find((column) => column.id === id);
const titleOf = (column) => (column.unit ? `${column.name} (${column.unit})` : column.name);
const errorPlaces = (id) => (["hausdorff_px", "delta_e", "depth_pct"].includes(id) ? fixed(1) : fixed(3));

const treeHeights = (heightPx) => data.focal_px / heightPx;
const away = (distance) => `${Number(distance.toPrecision(2))}`;
const distanceName = (heightPx) => `${whole(heightPx)} px high, ${away(treeHeights(heightPx))} tree heights away`;
const sunName = (sun) => `${suns[sun].elevation_deg}° high, azimuth ${suns[sun].azimuth_deg}°`;
const methodName = (method, level) => (level ? `${method}, level ${level}` : method === data.truth ? `${method} (the tree itself)` : method);

const heightChoices = heights.map((heightPx) => [heightPx, distanceName(heightPx)]);
const sunChoices = suns.map((_, sun) => [sun, sunName(sun)]);
const errorChoices = columns.map((column) => [column.id, titleOf(column)]);

const folderOf = (method) => `pictures/${encodeURIComponent(method)}`;
const pictureAt = (elevationDeg, heightPx, sun) =>
  pictures.find((picture) => picture.elevation_deg === elevationDeg && picture.height_px === heightPx && picture.sun === sun);
