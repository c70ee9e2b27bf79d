"use strict";
// The server holds everything; a page shows what it says once a second, so that any number of pages agree.
const byId = (id) => document.getElementById(id);
const state = { forms: [], files: [], jobs: [], offered: {}, command: "inspect", values: {}, open: new Set(), shown: {} };

function element(name, attributes, ...children) {
  const made = document.createElement(name);
  for (const [key, value] of Object.entries(attributes || {})) {
    if (key.startsWith("on")) made.addEventListener(key.slice(2), value);
    else if (typeof value === "boolean") made[key] = value;
    else made.setAttribute(key, value);
  }
  // Text stays text: what files and commands say is never taken for markup.
  made.append(...children.map((child) => (child instanceof Node ? child : document.createTextNode(String(child)))));
  return made;
}

async function ask(method, path, body) {
  const asked = { method, headers: { "X-Fogml": "1" } };
  if (body instanceof Blob) asked.body = body;
  else if (body !== undefined) asked.body = JSON.stringify(body);
  const answer = await fetch(path, asked);
  if (!answer.ok) throw new Error((await answer.text()).split("\n")[0] || answer.statusText);
  return answer.json();
}

function fault(text) {
  byId("fault").textContent = text;
  byId("fault").hidden = !text;
}

const form = () => state.forms.find((one) => one.command === state.command);
const valuesNow = () => (state.values[state.command] ||= {});
const sizeWords = (bytes) => bytes < 1e6 ? `${(bytes / 1e3).toFixed(1)} kB` : `${(bytes / 1e6).toFixed(1)} MB`;

// Files ------------------------------------------------------------------------------------------------------
async function upload(files) {
  byId("uploads").replaceChildren();
  for (const file of files) {
    const line = element("li", {}, `${file.name}: being copied …`);
    byId("uploads").append(line);
    try {
      if (file.size > state.upload_bytes) throw new Error(`is larger than ${sizeWords(state.upload_bytes)} allowed`);
      await ask("PUT", `/api/files/${encodeURIComponent(file.name)}`, file);
      line.remove();
    } catch (error) {
      line.textContent = `${file.name}: ${error.message}`;
      line.className = "bad";
    }
  }
  await refresh();
}

function drawFiles() {
  const sought = byId("filter").value.toLowerCase();
  const shown = state.files.filter((one) => one.name.toLowerCase().includes(sought));
  byId("count").textContent = state.files.length ? `${shown.length} of ${state.files.length} files` : "";
  const inputs = form().inputs.filter((one) => one.takes === "run");
  const runs = shown.filter((one) => one.run);
  const head = element("tr", {}, element("th", {}, "name"), ...inputs.map((input) => {
    const cell = element("th", { class: "use", title: input.help }, input.label);
    if (input.several && runs.length > 1) {
      cell.append(" ", element("button", { type: "button", class: "small plain", "data-all": input.key,
        onclick: () => chooseAll(input.key, runs) }, "all"));
    }
    return cell;
  }), element("th", { class: "size" }, "size"), element("th", {}, ""));
  const rows = shown.map((file) => element("tr", {}, element("td", { class: "name" }, file.name),
    ...inputs.map((input) => element("td", { class: "use" }, ...(file.run ? [element("input", {
      type: "checkbox", checked: chosen(input.key).includes(file.path), "data-file": file.name, "data-key": input.key,
      "aria-label": `${file.name}: ${input.label}`, onchange: (event) => choose(input, file.path, event.target.checked),
    })] : []))),
    element("td", { class: "size" }, sizeWords(file.bytes)),
    element("td", {}, ...(file.path === file.name ? [] : [element("button", { type: "button", class: "small plain",
      "aria-label": `Remove ${file.name}`, onclick: () => removeFile(file.name) }, "×")]))));
  byId("files").replaceChildren(...(state.files.length ? [element("table", {}, element("thead", {}, head), element("tbody", {}, ...rows))] : []));
}

const chosen = (key) => [valuesNow()[key] || []].flat();
const there = (input) => input.takes === "run" ? state.files.filter((one) => one.run).map((one) => one.path)
  : [...input.known, ...state.offered[input.takes]];

// What was removed has no mark left to take off.
function forgetGone() {
  for (const one of state.forms) {
    for (const input of one.inputs) {
      const held = state.values[one.command]?.[input.key];
      if (held) state.values[one.command][input.key] = [held].flat().filter((path) => there(input).includes(path));
    }
  }
}

function choose(input, path, wanted) {
  const others = input.several ? chosen(input.key).filter((one) => one !== path) : [];
  valuesNow()[input.key] = wanted ? [...others, path] : others;
  drawFiles();
  showLine();
}

function chooseAll(key, runs) {
  const paths = runs.map((one) => one.path);
  const all = paths.every((path) => chosen(key).includes(path));
  valuesNow()[key] = all ? chosen(key).filter((path) => !paths.includes(path)) : [...new Set([...chosen(key), ...paths])];
  drawFiles();
  showLine();
}

async function removeFile(name) {
  if (!confirm(`Remove ${name} from the app's folder?`)) return;
  try { await ask("DELETE", `/api/files/${encodeURIComponent(name)}`); } catch (error) { fault(error.message); }
  await refresh();
}

// Form -------------------------------------------------------------------------------------------------------
function drawForm() {
  byId("commands").replaceChildren(...state.forms.map((one) => element("button", { type: "button", "data-command": one.command,
    "aria-pressed": String(one.command === state.command), onclick: () => { state.command = one.command; drawForm(); } }, one.command)));
  byId("help").textContent = form().help;
  byId("settings").replaceChildren(...form().settings.map(drawSetting));
  drawChoices();
  drawFiles();
  showLine();
}

const NONE = { model: ["none yet: train one first", "choose a model"], models: ["none yet: train one first", "choose a model, or a fleet"], manifest: ["none yet: drop a table of units", "choose a table of units"],
  profile: ["none", "choose a profile, or tick draft"] };

function drawChoices() {
  byId("choices").replaceChildren(...form().inputs.filter((input) => input.takes !== "run").map((input) => {
    const names = there(input);
    const none = NONE[input.takes]?.[names.length ? 1 : 0] ?? "as it is";
    const held = chosen(input.key)[0] || "";
    const list = element("select", { "data-key": input.key, onchange: (event) => { valuesNow()[input.key] = event.target.value ? [event.target.value] : []; showLine(); } },
      element("option", { value: "" }, none), ...names.map((name) => element("option", { value: name, selected: name === held }, name)));
    return element("label", { title: input.help }, element("span", {}, input.label), list);
  }));
}

function drawSetting(one) {
  const held = valuesNow()[one.key];
  const keep = (value) => { valuesNow()[one.key] = value; showLine(); };
  let field;
  if (one.kind === "switch") {
    field = element("input", { type: "checkbox", checked: held === undefined ? Boolean(one.default) : held, onchange: (event) => keep(event.target.checked) });
  } else if (one.kind === "choice") {
    field = element("select", { onchange: (event) => keep(event.target.value) }, ...one.choices.map((name) => element("option", { value: name, selected: name === (held ?? one.default) }, name)));
  } else if (one.kind === "lines") {
    field = element("textarea", { rows: "2", oninput: (event) => keep([event.target.value]) }, (held || [""])[0]);
  } else {
    field = element("input", { type: "text", value: held ?? "", placeholder: one.default === "" ? one.metavar : String(one.default), list: `known-${one.key}`, oninput: (event) => keep(event.target.value) });
  }
  field.setAttribute("data-key", one.key);
  const known = element("datalist", { id: `known-${one.key}` }, ...one.known.map((name) => element("option", { value: name })));
  return element("label", {}, element("span", {}, one.key.replaceAll("_", " ")), field, element("small", {}, one.kind === "lines" ? `${one.help} One a line.` : one.help), known);
}

let asked = 0;
async function showLine() {
  const mine = ++asked;
  try {
    const told = await ask("POST", "/api/command", { command: state.command, values: valuesNow() });
    if (mine !== asked) return;
    byId("line").textContent = told.line || "";
    byId("lacking").textContent = told.fault || "";
    byId("run").disabled = Boolean(told.fault);
  } catch (error) { if (mine === asked) fault(error.message); }
}

async function run() {
  byId("run").disabled = true;
  try {
    const told = await ask("POST", "/api/jobs", { command: state.command, values: valuesNow() });
    state.open.add(told.name);
    byId("said").textContent = `Job ${told.name} is under way`;
    fault("");
    await refresh();
  } catch (error) { fault(error.message); }
  showLine();
}

// Jobs -------------------------------------------------------------------------------------------------------
const STATES = { waiting: "waits", running: "runs", done: "done", limit: "done, not all is well", refused: "bad input", cancelled: "cancelled", failed: "failed" };

function drawJobs() {
  byId("none").hidden = state.jobs.length > 0;
  byId("jobs").replaceChildren(...state.jobs.map((job) => {
    const moves = job.state === "running" || job.state === "waiting";
    const spent = job.seconds ? `${job.seconds.toFixed(1)} s` : "";
    const box = element("details", { class: "job", "data-job": job.name, "data-state": job.state, open: state.open.has(job.name) },
      element("summary", {}, element("b", {}, job.name), element("span", { class: `badge ${job.state}` }, STATES[job.state]),
        element("code", {}, job.line), element("span", { class: "told" }, job.progress || spent)));
    box.addEventListener("toggle", () => {
      if (box.open === state.open.has(job.name)) return;
      if (box.open) { state.open.add(job.name); look(job.name); } else state.open.delete(job.name);
    });
    const full = state.shown[job.name];
    const button = moves
      ? element("button", { type: "button", class: "small plain", onclick: () => act("POST", `/api/jobs/${job.name}/cancel`) }, "Cancel")
      : element("button", { type: "button", class: "small plain", onclick: () => { if (confirm(`Remove job ${job.name} and its results?`)) act("DELETE", `/api/jobs/${job.name}`); } }, "Remove");
    box.append(element("p", { class: "row" }, button, element("span", {}, `asked for ${job.made.replace("T", " ").slice(0, 19)} UTC`)));
    if (full) {
      if (full.stderr) box.append(element("pre", { class: job.state === "refused" || job.state === "failed" ? "bad" : "" }, full.stderr));
      box.append(element("ul", { class: "results" }, ...full.files.map((path) => element("li", {}, element("a", {
        href: `/results/${job.name}/${path.split("/").map(encodeURIComponent).join("/")}`, target: "_blank", rel: "noopener",
        class: path.endsWith(".html") ? "page" : "" }, path)))));
      if (full.stdout) box.append(element("pre", {}, full.stdout));
    }
    return box;
  }));
}

async function look(name) {
  try { state.shown[name] = await ask("GET", `/api/jobs/${name}`); drawJobs(); } catch (error) { state.open.delete(name); }
}

async function act(method, path) {
  try { await ask(method, path); fault(""); } catch (error) { fault(error.message); }
  await refresh();
}

// State ------------------------------------------------------------------------------------------------------
let last = "";
async function refresh(first = false) {
  try {
    const told = await ask("GET", first ? "/api/state?forms=1" : "/api/state");
    const same = JSON.stringify(told);
    if (byId("fault").dataset.away) { fault(""); delete byId("fault").dataset.away; }
    if (same === last) return;
    last = same;
    const files = JSON.stringify([told.files, told.offered]) !== JSON.stringify([state.files, state.offered]);
    const ended = state.jobs.filter((old) => told.jobs.some((job) => job.name === old.name && job.state !== old.state)).map((job) => job.name);
    Object.assign(state, told);
    byId("place").textContent = `${told.folder} · fogml ${told.version}`;
    if (first) drawForm();
    else if (files) { forgetGone(); drawChoices(); drawFiles(); showLine(); }
    drawJobs();
    for (const job of state.jobs) {
      if (state.open.has(job.name) && (!state.shown[job.name] || ended.includes(job.name) || job.state === "running")) await look(job.name);
    }
  } catch (error) {
    fault(error instanceof TypeError
      ? "The server does not answer. Jobs go on. Start fogml app for this folder again, and open the address that it prints."
      : `${error.message}.`);
    byId("fault").dataset.away = "1";
  }
}

byId("pick").addEventListener("change", (event) => { upload([...event.target.files]); event.target.value = ""; });
for (const name of ["dragover", "drop", "dragleave"]) {
  byId("drop").addEventListener(name, (event) => {
    event.preventDefault();
    byId("drop").classList.toggle("over", name === "dragover");
    if (name === "drop") upload([...event.dataTransfer.files]);
  });
}
byId("filter").addEventListener("input", drawFiles);
byId("run").addEventListener("click", run);
byId("copy").addEventListener("click", async () => {
  await navigator.clipboard.writeText(byId("line").textContent);
  byId("said").textContent = "Copied";
});
refresh(true).then(() => setInterval(() => refresh(), 1000));
