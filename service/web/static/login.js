// Log in, choose or change a password: the answer brings the cookie, then the page goes on.

import { enhance } from "./form.js";
import { ready } from "./ready.js";

const form = document.querySelector("form[data-next]");

enhance(form, () => location.replace(form.dataset.next));
ready();
