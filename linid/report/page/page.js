(function () {
  "use strict";
  const read = (id) => JSON.parse(document.getElementById(id).textContent);
  const figures = read("figures");
  const traces = read("traces");
  const config = {
    responsive: true,
    displaylogo: false,
    displayModeBar: window.matchMedia("(hover: hover)").matches ? "hover" : false,
    modeBarButtonsToRemove: ["select2d", "lasso2d"],
  };
  // On a touch screen a finger on a figure scrolls the page.
  const coarse = window.matchMedia("(pointer: coarse)").matches;
  const draw = (figure) => {
    if (coarse) figure.layout.dragmode = false;
    return Plotly.react(figure.id, figure.data, figure.layout, config);
  };
  const designed = Object.fromEntries(figures.map((figure) => [figure.id, figure.layout.height]));
  figures.forEach(draw);
  const choose = document.getElementById("choose-trace");
  if (choose) {
    choose.addEventListener("change", () => {
      draw(traces[choose.value]);
      document.getElementById("trace").setAttribute("aria-label", traces[choose.value].alt);
    });
  }
  // Plotly's own resize comes too late for the printer; setting the width acts at once.
  const fit = (figure, share) => {
    const width = document.getElementById(figure.id).clientWidth;
    const height = Math.round(share * designed[figure.id]);
    Plotly.relayout(figure.id, share < 1 ? { width, height } : { width: null, height, autosize: true });
  };
  let closed = [];
  window.addEventListener("beforeprint", () => {
    closed = Array.from(document.querySelectorAll("details:not([open])"));
    closed.forEach((one) => { one.open = true; });
    document.body.classList.add("printing");
    figures.forEach((figure) => fit(figure, 0.8));
  });
  window.addEventListener("afterprint", () => {
    closed.forEach((one) => { one.open = false; });
    document.body.classList.remove("printing");
    figures.forEach((figure) => fit(figure, 1));
  });
})();
