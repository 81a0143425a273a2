// The tables of costs, errors and methods.
const rowName = { name: "Method", value: (row) => methodName(row.method, row.level), text: true, meaning: "the method, and its level of detail where one was told; else it draws the one that belongs there" };
const costColumns = [
  rowName,
  { name: "time", unit: "ms", value: (row) => row.cost.ms, show: digits, meaning: "milliseconds of the device for one tree, median over frames full of trees" },
  { name: "time, 95 %", unit: "ms", value: (row) => (row.cost.frames < 3 ? NaN : row.cost.ms_p95), show: digits, meaning: "95 % of the frames took this or less, per tree; – where fewer than three were timed" },
  { name: "triangles", value: (row) => row.cost.triangles, show: whole, meaning: "triangles of one tree" },
  { name: "draw calls", value: (row) => row.cost.draw_calls, show: whole, meaning: "draw calls of any number of trees" },
  { name: "textures", value: (row) => row.cost.texture_bytes, show: bytes, meaning: "bytes on the device of the pictures seen at that distance, with all their smaller sizes" },
  { name: "geometry", value: (row) => row.cost.geometry_bytes, show: bytes, meaning: "bytes on the device of the vertices and triangles seen at that distance" },
  { name: "overdraw", unit: "×", value: (row) => row.cost.overdraw, show: digits, meaning: "area of all triangles as seen over the area covered: how often a pixel is shaded at most" },
];
const errorColumns = [
  rowName,
  ...columns.map((column) => ({ name: column.name, unit: column.unit, value: (row) => errorOf(row.error, column.id), show: errorPlaces(column.id), meaning: column.meaning, id: column.id })),
];
const methodColumns = [
  { name: "Method", value: (run) => methodName(run.method), text: true, meaning: "the method" },
  { name: "build", unit: "ms", value: (run) => run.build_ms, show: whole, meaning: "milliseconds to build it from the tree" },
  { name: "memory", value: (run) => run.memory_bytes, show: bytes, meaning: "bytes on the device of all its textures and geometry, all levels" },
  { name: "file", value: (run) => run.disk_bytes || NaN, show: bytes, meaning: "bytes of its GLB file with all levels; – where none could be written" },
  { name: "levels", value: (run) => run.levels.length, show: whole, meaning: "levels of detail" },
  { name: "flicker", value: (run) => run.motion?.flicker, unit: "× the tree's", show: fixed(2), meaning: "mean FLIP from one frame to the next while the viewer walks round the tree in steps of 2°, over that of the true tree: 1 flickers as it does" },
  { name: "round it", value: (run) => run.motion?.orbit_jod, unit: "JOD", show: fixed(2), meaning: "quality of the film of that walk beside the true tree's by ColorVideoVDP: 10 where nobody sees a difference, 1 less where three of four viewers would choose the other" },
  { name: "popping", value: (run) => run.motion?.popping, show: fixed(2), meaning: "the largest step while the viewer moves away, over the median of the steps around it; up to 2 nothing jumps, – where nothing of it changes with distance" },
  { name: "away", value: (run) => run.motion?.dolly_jod, unit: "JOD", show: fixed(2), meaning: "quality of the film of that walk away beside the true tree's; – where nothing of it changes with distance" },
];

function showTables() {
  const heightPx = Number(byId("costs-height").value);
  const here = rows.filter((row) => row.height_px === heightPx);
  const least = (column) => Math.min(...here.filter((row) => row.method !== data.truth && !row.failed).map(column.value).filter(number));
  const best = errorColumns.slice(1).map((column) => [column, least(column)]);
  const mark = (column, row) => (best.some(([of, value]) => of === column && row.method !== data.truth && of.value(row) === value) ? "good" : null);
  byId("costs-table").replaceChildren(sortable(`Cost where the tree is ${distanceName(heightPx)}`, costColumns, here, 1));
  byId("errors-table").replaceChildren(
    sortable(`Mean errors over all views and suns where the tree is ${distanceName(heightPx)}; 0 is perfect, the least of each column is marked`, errorColumns, here, 1, mark));
}

function startTables() {
  choices(byId("costs-height"), heightChoices);
  byId("costs-height").addEventListener("change", showTables);
  showTables();
  byId("methods-table").replaceChildren(sortable("All levels and distances together", methodColumns, compared, 0));
  const named = [...costColumns.slice(1), ...errorColumns.slice(1), ...methodColumns.slice(1)];
  byId("glossary").replaceChildren(
    ...named.flatMap((column) => [element("dt", {}, column.unit ? `${column.name} (${column.unit})` : column.name), element("dd", {}, column.meaning)]));
}
