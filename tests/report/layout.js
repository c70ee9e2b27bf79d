// What is cut off, covers something else, or is wider than its place.
function (paper) {
  var faults = [], most = 20;
  function words(e) { return "'" + (e.textContent || "").trim().replace(/\s+/g, " ").slice(0, 40) + "'"; }
  function scrolls(e) {
    for (; e && e !== document.body; e = e.parentElement) {
      if (e instanceof HTMLElement && /auto|scroll/.test(getComputedStyle(e).overflowX)) { return e; }
    }
    return null;
  }
  var root = document.documentElement;
  if (root.scrollWidth > root.clientWidth + 1) {
    faults.push("the page is " + root.scrollWidth + " wide, " + root.clientWidth + " are there");
  }
  document.querySelectorAll("main *, footer *").forEach(function (e) {
    if (!(e instanceof HTMLElement) || e.closest(".plot") || !e.clientWidth) { return; }
    var style = getComputedStyle(e);
    if (style.display === "inline" || style.visibility === "hidden") { return; }
    if (e.scrollWidth > e.clientWidth + 1 && (paper || !/auto|scroll/.test(style.overflowX))) {
      faults.push(e.tagName + "." + e.className + " " + words(e) + " needs " + e.scrollWidth + ", has " + e.clientWidth);
    }
  });
  document.querySelectorAll("svg text").forEach(function (e) {
    var box = e.getBoundingClientRect(), room = e.ownerSVGElement.getBoundingClientRect();
    if (e.closest(".plot") || !box.width) { return; }
    if (box.left < room.left - 1 || box.right > room.right + 1 || box.top < room.top - 2 || box.bottom > room.bottom + 2) {
      faults.push(words(e) + " is cut by its figure's edge");
    }
  });
  // A word that is broken within, and an interval; long names may be, and the manual's wide tables.
  document.querySelectorAll("table th, table td").forEach(function (e) {
    if (e.closest(".manual")) { return; }
    var inside = document.createTreeWalker(e, NodeFilter.SHOW_TEXT);
    for (var text = inside.nextNode(); text; text = inside.nextNode()) {
      var whole = /(?<![\w./:-])[A-Za-z]{2,16}(?![\w./:-])|\([^()]*…[^()]*\)/g;
      for (var found = whole.exec(text.data); found; found = whole.exec(text.data)) {
        var part = document.createRange();
        part.setStart(text, found.index);
        part.setEnd(text, found.index + found[0].length);
        if (part.getClientRects().length > 1) { faults.push("'" + found[0] + "' is broken in " + words(e)); }
      }
    }
  });
  // Texts that are seen, by their boxes; those of one element belong together.
  var boxes = [], walker = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
  for (var node = walker.nextNode(); node; node = walker.nextNode()) {
    var holder = node.parentElement;
    if (!node.data.trim() || !holder || holder.closest("script, style, noscript, .hoverlayer, .modebar, math, annotation")) { continue; }
    if (holder.closest("details:not([open])") && !holder.closest("summary")) { continue; }
    var seen = getComputedStyle(holder);
    if (seen.visibility === "hidden" || seen.display === "none" || +seen.opacity === 0) { continue; }
    var range = document.createRange();
    range.selectNodeContents(node);
    var unit = holder.closest("text") || holder;
    Array.prototype.forEach.call(range.getClientRects(), function (box) {
      if (box.width > 1 && box.height > 1) { boxes.push({ box: box, unit: unit, text: node.data.trim().slice(0, 40) }); }
    });
  }
  boxes.sort(function (a, b) { return a.box.top - b.box.top; });
  for (var i = 0; i < boxes.length; i++) {
    var a = boxes[i].box;
    for (var j = i + 1; j < boxes.length && boxes[j].box.top < a.bottom; j++) {
      var b = boxes[j].box, one = boxes[i].unit, other = boxes[j].unit;
      if (one === other || one.contains(other) || other.contains(one)) { continue; }
      if (scrolls(one) !== scrolls(other)) { continue; }
      var wide = Math.min(a.right, b.right) - Math.max(a.left, b.left);
      var high = Math.min(a.bottom, b.bottom) - Math.max(a.top, b.top);
      // Boxes hold the room above and below letters, which lines may share.
      if (wide > 2 && high > 0.4 * Math.min(a.height, b.height)) {
        faults.push("'" + boxes[i].text + "' and '" + boxes[j].text + "' cover each other");
      }
    }
  }
  return faults.slice(0, most);
}
