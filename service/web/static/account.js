// On every page: the button that logs a person out.

import { post } from "./api.js";

document.getElementById("log-out")?.addEventListener("click", async () => {
  await post("/api/v1/logout");
  location.assign("/login");
});
