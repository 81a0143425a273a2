// Tables: plain ones, and those that sort by a press on a column's head.

/** `columns`: { name, unit, meaning, value(row), show(value), text }; the first names the row. */
function table(caption, columns, rows, mark = () => null) {
  const cell = (column, row, i) => {
    const value = column.value(row);
    const shown = column.show ? column.show(value) : value;
    return i === 0 ? element("th", { scope: "row" }, shown) : element("td", { class: mark(column, row) ?? (column.text ? "text" : null) }, shown);
  };
  const line = (row) => (row.failed
    ? element("tr", {}, cell(columns[0], row, 0), element("td", { class: "text failed", colspan: columns.length - 1 }, `failed: ${row.failed}`))
    : element("tr", {}, ...columns.map((column, i) => cell(column, row, i))));
  const heads = columns.map((column) =>
    element("th", { scope: "col", class: column.text ? "text" : null, title: column.meaning },
      column.name, column.unit ? element("span", { class: "unit" }, ` ${column.unit}`) : null));
  const body = element("tbody", {}, ...rows.map(line));
  const made = element("table", { "aria-label": caption }, element("thead", {}, element("tr", {}, ...heads)), body);
  return { made, heads, body, line };
}

function plainTable(caption, columns, rows, mark) {
  return scrolling(caption, table(caption, columns, rows, mark).made);
}

/** The same, sorted by `first` to begin with. */
function sortable(caption, columns, rows, first, mark) {
  const { made, heads, body, line } = table(caption, columns, rows, mark);
  let [by, up] = [-1, true];
  const order = (a, b) => {
    const [x, y] = [a, b].map((row) => (row.failed && by > 0 ? NaN : columns[by].value(row)));
    if (typeof x === "string" || typeof y === "string") return (up ? 1 : -1) * String(x).localeCompare(String(y));
    // What has no figure comes last in both orders.
    if (number(x) !== number(y)) return number(x) ? -1 : 1;
    return number(x) ? (up ? x - y : y - x) : 0;
  };
  const sort = (column) => {
    up = column === by ? !up : true;
    by = column;
    heads.forEach((head, i) => (i === by ? head.setAttribute("aria-sort", up ? "ascending" : "descending") : head.removeAttribute("aria-sort")));
    body.replaceChildren(...[...rows].sort(order).map(line));
  };
  heads.forEach((head, i) => head.replaceChildren(element("button", { type: "button", onclick: () => sort(i) }, ...head.childNodes)));
  sort(first);
  return scrolling(caption, made);
}
