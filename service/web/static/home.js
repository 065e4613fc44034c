// The first page: cells, campaigns, and the forms that start something.

import { watchCells } from "./cells.js";
import { enhance, tell } from "./form.js";
import { checkFields } from "./form_check.js";
import { guide } from "./new_campaign.js";
import { keepFresh, refresh } from "./parts.js";
import { ready } from "./ready.js";
import { say } from "./words.js";

const REFRESH_S = 2;

const cells = document.getElementById("cells");
const campaigns = document.getElementById("campaigns");
const newCampaign = document.getElementById("new-campaign");
const newCell = document.getElementById("new-cell");

function open(accepted) {
  location.assign(`/campaigns/${accepted.id}`);
}

// Another tab, or another person, may have made a cell: offer it, and leave the choice alone.
function offerCells() {
  const select = newCampaign.elements.namedItem("cell");
  const offered = new Set(Array.from(select.options, (option) => option.value));
  for (const { dataset } of cells.querySelectorAll("[data-cell]")) {
    if (!offered.has(dataset.cell)) select.add(new Option(dataset.cell, dataset.cell));
  }
}

enhance(newCampaign, open);
checkFields(newCell);
const checkAgain = guide(newCampaign);
enhance(document.getElementById("import-bundle"), open);
enhance(newCell, async (cell) => {
  newCell.reset();
  tell(newCell, say("cell_created", { cell: cell.name }), "good");
  await refresh(cells);
  newCampaign.elements.namedItem("cell").value = cell.name;
  checkAgain();
});
watchCells(cells);
cells.addEventListener("refreshed", () => {
  offerCells();
  checkAgain();
});
keepFresh(cells, REFRESH_S);
keepFresh(campaigns, REFRESH_S);
ready();
