// Strips of what was seen in motion.

function startMotion() {
  const { orbit_frames: orbit, dolly_frames: dolly, dolly_px: [first, last] } = data.identity.plan.motion;
  byId("motion-lead").textContent =
    `Left, a walk round the tree in ${orbit} steps of 2°: flicker is how much changes from frame to frame, over how much of the true tree does. ` +
    `Right, a walk of ${dolly} steps away from it, from ${whole(first)} to ${whole(last)} px high, around the step at which most changes: popping is that step over the median of those around it, and up to 2 nothing jumps. ` +
    "Where nothing of a method changes with distance nothing can pop, and there is no such strip. " +
    `JOD is what ColorVideoVDP says of the whole film beside the true tree’s, ${whole(data.frames_per_second)} frames a second: 10 where nobody sees a difference, 1 less where three of four viewers would choose the other; what is wrong in every frame counts as well as what flickers or jumps. ` +
    "The true film has many samples for each pixel, so that the tree’s own geometry with one has less than 10, too.";
  const strip = (run, i, told) => {
    const image = element("img", { loading: "lazy", alt: `${run.method}, ${told}`, width: 788, height: 128 });
    image.onerror = () => image.replaceWith(element("span", { class: "missing" }, "not on disk"));
    image.src = `${folderOf(run.method)}/${data.strips[i]}`;
    return element("figure", {}, image, element("figcaption", {}, told));
  };
  const one = (run) => {
    if (!run.motion) return element("div", { class: "motion" }, element("h3", {}, methodName(run.method)), element("p", { class: "small" }, "Not looked at in motion; why is said below."));
    const { flicker, orbit_jod: round, popping, dolly_jod: gone, largest_at_px: at } = run.motion;
    const strips = [strip(run, 0, `round it: flicker ${fixed(2)(flicker)}, ${fixed(1)(round)} JOD`)];
    if (number(popping)) strips.push(strip(run, 1, `away: popping ${fixed(2)(popping)}, largest at ${whole(at)} px, ${fixed(1)(gone)} JOD`));
    return element("div", { class: "motion" }, element("h3", {}, methodName(run.method)), element("div", { class: "strips" }, ...strips));
  };
  const truth = { method: "truth" };
  const strips = element("div", { class: "strips" }, strip(truth, 0, "round it: many samples for each pixel"), strip(truth, 1, "away, from its begin to its end"));
  byId("motion-strips").replaceChildren(element("div", { class: "motion" }, element("h3", {}, "the true tree"), strips), ...compared.map(one));
}
