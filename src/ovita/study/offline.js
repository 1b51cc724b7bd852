"use strict";
/* A study in one file: shows the first page without an answer, keeps answers in this browser, hands them over as a file. */
(function () {
  const about = JSON.parse(document.getElementById("about").textContent);
  const place = document.querySelector("main"), key = "ovita-study-" + about.study + "-" + about.participant;
  let memory = "[]", lasting = true;

  function load() {
    try { return JSON.parse(localStorage.getItem(key) || "[]"); } catch (e) { lasting = false; return JSON.parse(memory); }
  }

  function save(events) {
    memory = JSON.stringify(events);
    try { localStorage.setItem(key, memory); } catch (e) { lasting = false; }
  }

  function now() { return new Date().toISOString().replace(/\.\d+Z$/, "Z"); }

  function current(events) {
    if (events.some(function (e) { return e.event === "withdrawn"; })) return "gone";
    if (!events.some(function (e) { return e.event === "consent"; })) return "consent";
    const done = new Set(events.filter(function (e) { return e.event === "answer"; }).map(function (e) { return e.page; }));
    return about.pages.find(function (id) { return !done.has(id); }) || "done";
  }

  function show() {
    const events = load(), page = current(events);
    if (place.dataset.page === page) return;
    place.dataset.page = page;
    place.replaceChildren(document.getElementById("page-" + page).content.cloneNode(true));
    if (!lasting) {
      const warning = document.createElement("p");
      warning.className = "alert";
      warning.textContent = "This browser keeps nothing between visits: please go through to the end without closing this page.";
      place.prepend(warning);
    }
    if (about.pages.includes(page) && !events.some(function (e) { return e.event === "shown" && e.page === page; })) {
      save(events.concat([{ event: "shown", when: now(), page: page }]));
    }
    ovitaMount(place);
    window.scrollTo(0, 0);
  }

  function complain(form, text) {
    form.querySelectorAll(".alert").forEach(function (node) { node.remove(); });
    const alert = document.createElement("p");
    alert.className = "alert";
    alert.setAttribute("role", "alert");
    alert.textContent = text;
    form.prepend(alert);
    alert.scrollIntoView({ block: "center" });
  }

  function answers(form) {
    const values = {}, given = new FormData(form);
    let missing = 0;
    form.querySelectorAll("fieldset[data-question]").forEach(function (box) {
      const name = box.dataset.question, value = given.get(name);
      box.classList.toggle("missing", !value);
      if (!value) missing += 1;
      else values[name] = /^\d+$/.test(value) ? Number(value) : value;
    });
    const comment = (given.get("comment") || "").trim();
    if (comment) values.comment = comment;
    return missing ? null : values;
  }

  function answer(form) {
    const values = answers(form), page = new FormData(form).get("page"), events = load();
    if (values === null) { complain(form, "Please answer the marked questions."); return; }
    if (current(events) === page) {
      const shown = events.find(function (e) { return e.event === "shown" && e.page === page; }), when = now();
      const seconds = shown ? Math.max((Date.parse(when) - Date.parse(shown.when)) / 1000, 0) : 0;
      save(events.concat([{ event: "answer", when: when, page: page, values: values, seconds: seconds }]));
    }
    show();
  }

  function handOver() {
    const head = { study: about.study, participant: about.participant, token: about.token };
    const text = [head].concat(load()).map(function (line) { return JSON.stringify(line) + "\n"; }).join("");
    const link = document.createElement("a");
    link.href = URL.createObjectURL(new Blob([text], { type: "application/jsonl" }));
    link.download = "answers-" + about.participant + ".jsonl";
    link.click();
  }

  document.addEventListener("submit", function (event) {
    event.preventDefault();
    const form = event.target, wish = event.submitter ? event.submitter.value : "answer", events = load();
    if (wish === "consent") {
      if (!form.querySelector("[name=agree]").checked) { complain(form, "Please tick the box if you agree, or close the page."); return; }
      if (current(events) === "consent") save([{ event: "consent", when: now(), consent_sha256: about.consent }]);
      show();
    } else if (wish === "withdraw") { save([{ event: "withdrawn", when: now() }]); show(); }
    else if (wish === "hand over") handOver();
    else answer(form);
  });
  window.addEventListener("storage", show);
  show();
})();
