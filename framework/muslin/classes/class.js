"use strict";
// Sorts the table by a column when its heading is pressed; once more turns it round. Empty cells stay last.
for (const table of document.querySelectorAll("table.sortable")) {
  const body = table.tBodies[0];
  const collate = new Intl.Collator(undefined, {numeric: true, sensitivity: "base"}).compare;
  table.tHead.addEventListener("click", (event) => {
    const button = event.target.closest("button");
    if (!button) return;
    const head = button.closest("th");
    const column = [...head.parentNode.children].indexOf(head);
    const down = head.getAttribute("aria-sort") === "ascending";
    for (const other of head.parentNode.children) other.removeAttribute("aria-sort");
    head.setAttribute("aria-sort", down ? "descending" : "ascending");
    const value = (row) => row.cells[column].dataset.value ?? row.cells[column].textContent;
    const number = head.classList.contains("number");
    const order = (a, b) => {
      const [x, y] = [value(a), value(b)];
      if (x === "" || y === "") return (x === "") - (y === "");
      return (down ? -1 : 1) * (number ? x - y : collate(x, y));
    };
    body.append(...[...body.rows].sort(order));
  });
}
// Narrows it to the rows that have the words, are of the kind, and in which the task stands as asked.
const filter = document.getElementById("filter");
const grades = document.querySelector(".scroll.grades");
const rows = [...grades.querySelectorAll("tbody tr")];
const said = new Map(rows.map((row) => [row, [0, 1, row.cells.length - 1].map((k) => row.cells[k].textContent).join(" ").toLowerCase()]));
const ask = filter.elements;
const narrow = () => {
  const words = ask.text.value.toLowerCase().split(/\s+/).filter(Boolean);
  let shown = 0;
  for (const row of rows) {
    const tasks = [...row.querySelectorAll("td.task")];
    const asked = ask.task.value === "" ? tasks : [tasks[ask.task.value]];
    const stands = ask.stand.value === "" || asked.some((cell) => cell.classList.contains(ask.stand.value));
    const kind = ask.kind.value === "" || row.dataset.kinds.split(" ").includes(ask.kind.value);
    row.hidden = !(stands && kind && words.every((word) => said.get(row).includes(word)));
    shown += !row.hidden;
  }
  ask.shown.value = `${shown} of ${rows.length}`;
  grades.classList.toggle("tall", ask.tall.checked);
};
for (const field of ask) field.addEventListener("input", narrow);
filter.addEventListener("submit", (event) => event.preventDefault());
filter.hidden = false;
narrow();
