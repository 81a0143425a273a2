// Strips of what was seen in motion.

function startMotion() {
  const { orbit_frames: orbit, dolly_px: [first, last] } = data.identity.plan.motion;
  byId("motion-lead").textContent =
    `Left, a walk round the tree in ${orbit} steps of 2°: flicker is how much changes from frame to frame, over how much of the tree itself does. ` +
    `Right, a walk away from it, from ${whole(first)} to ${whole(last)} px high, around the step at which most changes: popping is that step over the median of those around it, and up to 2 nothing jumps. ` +
    "Where nothing of a method changes with distance nothing can pop, and there is no such strip.";
  const strip = (run, i, told) => {
    const image = element("img", { loading: "lazy", alt: `${run.method}, ${told}`, width: 788, height: 128 });
    image.onerror = () => image.replaceWith(element("span", { class: "missing" }, "not on disk"));
    image.src = `${folderOf(run.method)}/${data.strips[i]}`;
    return element("figure", {}, image, element("figcaption", {}, told));
  };
  const one = (run) => {
    const { flicker, popping, largest_at_px: at } = run.motion;
    const strips = [strip(run, 0, `round it: flicker ${fixed(2)(flicker)}`)];
    if (number(popping)) strips.push(strip(run, 1, `away: popping ${fixed(2)(popping)}, largest at ${whole(at)} px`));
    return element("div", { class: "motion" }, element("h3", {}, methodName(run.method)), element("div", { class: "strips" }, ...strips));
  };
  byId("motion-strips").replaceChildren(...compared.map(one));
}
