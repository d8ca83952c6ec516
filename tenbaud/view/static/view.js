// The page: one set of instruments, fed by a live flight or by recordings.

import { live } from "./live.js";
import { replay } from "./replay.js";
import { show } from "./show.js";

show(document.getElementById("transport") ? replay : live);
